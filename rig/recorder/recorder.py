"""One device and one session file: what is measured is on the disk before it is let go of."""

from __future__ import annotations

import logging
import random
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Self

from rig.clock.host import HostWatch, SystemClock
from rig.errors import DeviceError, SessionError
from rig.link.client import BOOT_WAIT_S, Device
from rig.link.messages import Arm, DisarmReason, Identity, Phase, pack_label, unpack_label
from rig.link.port import Port, open_port, port_clock
from rig.link.refusals import DeviceRefusedError
from rig.ports import told
from rig.protocol.measurable import record_ms
from rig.reasons import Reason, make_error, sentences
from rig.recorder.feed import StateFeed
from rig.recorder.interrupts import Interrupts, StoppedError
from rig.recorder.published import PublishedState
from rig.records import ClockSample, Drop, Pulse
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rig.link.transcript import Direction, Record
    from rig.protocol.protocol import Protocol
    from rig.recorder.sink import NullSink
    from rig.session.store import Session

log = logging.getLogger(__name__)
ARM_TIMEOUT_MS = 10_000
_PING_S = 0.37  # mean distance of clock samples: in step with nothing
_ARMED_S = 0.1  # at most, while armed: the device disarms itself when the host is silent
_REFERENCE_S = 10.0  # between two questions for the latest pulse of the reference


def arm_order(protocol: Protocol, label: int, timeout_ms: int, record_ms: int) -> Arm:
    """Return the request for a protocol's gates and release; see `Arm` for the rest."""
    gates, release = protocol.gates, protocol.release
    mask, pulse_us = gates.mask if gates else 0, round(release.pulse * 1e6)
    return Arm(label, mask, 1 << release.channel, pulse_us, timeout_ms, record_ms)


class Recorder:
    """The owner of the port and of the session.

    All bytes are put into the session before anything is done with them; a drop is committed before
    the device is told to forget it.

    Parameters
    ----------
    session
        Open for writing.
    url
        The port.
    interrupts
        Kept waiting during each call; by default nobody's.
    feed
        What is told of everything that becomes known.
    halted
        Asked all the time whether everything shall be off.
    meet
        Called with who is there before anything is asked of it; gives what else is known of it.

    Attributes
    ----------
    armed
        Run and attempt of the drop that waits for `fire`.
    """

    def __init__(
        self,
        session: Session | NullSink,
        url: str,
        interrupts: Interrupts | None = None,
        *,
        feed: StateFeed | None = None,
        halted: Callable[[], bool] = lambda: False,
        meet: Callable[[Identity], dict[str, str]] = lambda _: {},
    ) -> None:
        self.session = session
        self.url = url
        self.interrupts = Interrupts() if interrupts is None else interrupts
        self._feed = feed or StateFeed(PublishedState())
        self._halted = halted
        self._meet = meet
        self._port: Port | None = None
        self._device: Device | None = None
        self._uneven = random.Random(0)
        self.armed: tuple[int, int] | None = None
        self._sample: ClockSample | None = None  # the latest
        self._host: HostWatch | None = None
        self._reference_ns = 0  # when to ask for the next pulse
        self._disk_must_not_matter = False
        self._checks: tuple[Callable[[], None], ...] = ()  # what may end a request now

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *_exc: object) -> None:
        self.close()

    def connect(self, port: Port | None = None) -> Identity:
        """Learn who is there.

        Parameters
        ----------
        port
            What `give_up` returned, with a board that is running; else the port is opened.

        Raises
        ------
        DeviceError
            No such port, nobody there, or another protocol version.
        """
        with self.interrupts.held():
            self._port = open_port(self.url) if port is None else port
            try:
                self.clock = port_clock(self._port)
                self._host = HostWatch() if isinstance(self.clock, SystemClock) else None
                self._reference_ns = self.clock.now_ns()
                self._device = Device(
                    self._port, self.clock, self._log, self._note, give_way=self._give_way
                )
                identity = self._device.connect(BOOT_WAIT_S if port is None else 0.0)
                record = identity.json() | {"port": told(self.url)} | self._meet(identity)
                self.session.add_identity(record, self.clock.now_ns())
                self.session.commit()
            except BaseException:
                self.close()
                raise
            return identity

    def close(self) -> None:
        """Make safe (an armed release is disarmed, a recording is left alone) and close."""
        if self._port is None:
            return
        with self.interrupts.held():
            try:
                with suppress(DeviceError):
                    if self.armed is not None:
                        self.abort()
            finally:
                port, self._port = self._port, None
                port.close()
            self._log_rest()
            self.session.commit()

    def give_up(self) -> Port | None:
        """Make safe and let go of the port without closing it; `None` when there is none."""
        with self.interrupts.held():
            if self.armed is not None:
                self.abort()
            port, self._port = self._port, None
            self._log_rest()
            return port

    def _log_rest(self) -> None:
        """Log what STOP sent past everything, and no request has followed."""
        if self._device is not None:
            with suppress(SessionError):  # it waits in memory
                self._device.log_past()

    @property
    def device(self) -> Device:
        """The device client.

        Raises
        ------
        DeviceError
            Before `connect` and after `close`.
        """
        if self._device is None or self._port is None:
            raise make_error(DeviceError, "no_connection")
        return self._device

    @property
    def lapsed(self) -> DisarmReason | None:
        """Why the device disarmed itself since it was armed, as far as it has said so."""
        return self._device.transcript.disarmed if self._device else None

    def wait(self, seconds: float) -> None:
        """Let time pass and use it to compare clocks, at uneven intervals.

        What is armed stays so: the device hears from this program often enough.
        """
        until = self.clock.now_ns() + round(seconds * 1e9)
        while not self._halted():
            rest_s = (until - self.clock.now_ns()) * 1e-9
            if rest_s <= 0.0:
                break
            longest_s = self.ping_gap_s()
            self.clock.sleep(min(rest_s, longest_s if self.armed is None else _ARMED_S))
            self.ping() if self.armed is None else self.look()
        with self.interrupts.held():
            self.session.commit()

    def look(self) -> None:
        """Ask what the device is doing, and let it know that somebody is there."""
        with self.interrupts.held(), self._unless(self.interrupts.check, self._go_on):
            self.device.status()

    def ping_gap_s(self) -> float:
        """Return the time to the next clock sample, s: another one each time."""
        return _PING_S * self._uneven.uniform(0.5, 1.5)

    def ping(self) -> None:
        """Take one clock sample, now and then one of the 1 Hz reference; not while armed."""
        with self.interrupts.held():
            if self._host is not None and (gap := self._host.look()) is not None:
                self.session.add_timing(gap)
            with self._unless(self.interrupts.check, self._go_on):
                self._sample = self.device.ping()
                if self.clock.now_ns() >= self._reference_ns:
                    self._reference_ns = self.clock.now_ns() + round(_REFERENCE_S * 1e9)
                    self.device.reference()

    def statistics(self) -> dict[str, object]:
        """Count what went over the line since it is up, see rig/daemon/API.md."""
        trip = self._sample
        return self.device.statistics() | {
            "round_trip_s": None if trip is None else (trip.host_recv_ns - trip.host_send_ns) * 1e-9
        }

    def held(self) -> tuple[int, int] | None:
        """Run and attempt of a drop the device still holds, or `None`."""
        with self.interrupts.held():
            state = self.device.status()
        if state.phase in {Phase.HOLDING, Phase.RECORDING} and state.label:
            return unpack_label(state.label)
        return None

    def arm(self, run: int, attempt: int, protocol: Protocol) -> int:
        """Prepare a drop; the release stays off until `fire`. Until then wait with `wait` only.

        Returns
        -------
        int
            The token for `fire`.

        Raises
        ------
        DeviceRefusedError
            A gate is blocked, or the device cannot do what the protocol asks.
        """
        label = pack_label(run, attempt)
        order = arm_order(protocol, label, ARM_TIMEOUT_MS, record_ms(protocol))
        with self.interrupts.held():
            try:
                with self._unless(self.interrupts.check, self._go_on):
                    token = self.device.arm(order)
            except (StoppedError, KeyboardInterrupt):
                self.abort()  # the device may have heard what it did not answer
                raise
            self.armed = run, attempt
            self.state(run, attempt, RunState.ARMED)
            return token

    def fire(self, token: int) -> None:
        """Let go. What was armed is on the disk as fired before the request leaves.

        Raises
        ------
        DeviceRefusedError
            Nothing was let go: a beam was disturbed, or the device has disarmed itself.
        """
        run, attempt = self.armed or (0, 0)
        with self.interrupts.held():
            with self._unless(self.interrupts.check, self._go_on):
                self.device.status()  # a slow disk may take most of the silence allowed, twice
            self.state(run, attempt, RunState.FIRED)
            self.interrupts.check()  # whoever asked to stop until now sees nothing fall
            self._go_on()
            try:
                with self._unless(self._go_on):
                    self.device.fire(token)
            except (StoppedError, DeviceRefusedError) as ended:
                # A STOP that overtook the answer makes the device refuse the repeated request.
                if isinstance(ended, StoppedError) or self._halted():
                    self.abort()
                    if self.held() == (run, attempt):
                        self.armed = None  # it had heard: what fell is collected
                raise
            self.armed = None  # from here on there is a recording, which `close` leaves alone

    def collect(self, run: int, attempt: int) -> Drop:
        """Read the drop whole, store it, and only then let the device forget it."""
        with self.interrupts.held():
            return self._keep(self.device.collect(pack_label(run, attempt), stop=self._halted))

    def fetch(self, run: int, attempt: int) -> Drop | None:
        """Read a held drop; `None` when the session has it and only the device did not know.

        Raises
        ------
        DeviceError
            The session has another drop of this run and attempt, or the device is in trouble.
        """
        with self.interrupts.held():
            drop = self.device.collect(pack_label(run, attempt), timeout=0.0)
            stored = self.session.drop(run, attempt)
            if stored is None:
                return self._keep(drop)
            if stored.certificate != drop.certificate or stored.fire_tick != drop.fire_tick:
                raise make_error(DeviceError, "drop_differs", run=run, attempt=attempt)
            self._acknowledge(drop)
            return None

    def abort(self) -> None:
        """Switch everything off, even when the disk does not take the record of it any more."""
        with self.interrupts.held():
            self._disk_must_not_matter = True
            try:
                self.device.abort()
                self.armed = None
            finally:
                self._disk_must_not_matter = False

    def state(
        self, run: int, attempt: int, state: RunState, reasons: tuple[Reason, ...] = ()
    ) -> None:
        """Log where a run stands, on the disk when this returns."""
        with self.interrupts.held():
            self.session.add_state(run, attempt, state, self.clock.now_ns(), reasons)
            self.session.commit()
            if state is RunState.INTERRUPTED:
                log.info("run %d, attempt %d: interrupted: %s", run, attempt, sentences(reasons))
            self._feed.state(run, attempt, state, reasons)

    @contextmanager
    def _unless(self, *checks: Callable[[], None]) -> Iterator[None]:
        """Let these end what gets no answer: on a bad line a request is repeated for seconds."""
        self._checks = checks
        try:
            yield
        finally:
            self._checks = ()

    def _give_way(self) -> None:
        self._halted()  # also tells whoever owns this that the device is being waited for
        for check in self._checks:
            check()

    def _go_on(self) -> None:
        if self._halted():
            raise make_error(StoppedError, "switched_off")

    def _keep(self, drop: Drop) -> Drop:
        self.session.add_drop(drop, host_ns=self.clock.now_ns(), provenance="device")
        self.state(drop.run, drop.attempt, RunState.RECORDED, drop.faults)
        log.info("run %d, attempt %d: recorded, %d edges", drop.run, drop.attempt, len(drop.edges))
        self._feed.show_drop(drop)
        self._acknowledge(drop)
        return drop

    def _acknowledge(self, drop: Drop) -> None:
        if drop.certificate is not None:
            self.device.acknowledge(pack_label(*drop.job), drop.certificate.crc32)
            self.session.commit()

    def _log(self, direction: Direction, host_ns: int, data: bytes) -> None:
        try:
            self.session.log_bytes(direction, host_ns, data)
        except SessionError:  # the bytes wait in memory, and the next commit says so
            if not self._disk_must_not_matter:
                raise

    def _note(self, record: Record) -> None:
        if isinstance(record, ClockSample | Pulse):
            self.session.add_timing(record)
        self._feed.know(record)
