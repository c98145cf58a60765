"""One device and one session file: what is measured is on the disk before it is let go of."""

import logging
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rig.clock.host import HostWatch, SystemClock
from rig.errors import DeviceError, SessionError, StoppedError
from rig.link.client import BOOT_WAIT_S, Device
from rig.link.messages import Arm, Identity, pack_label
from rig.link.port import Port, open_port, port_clock
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Record
from rig.ports import told
from rig.protocol.measurable import record_ms
from rig.protocol.protocol import Protocol
from rig.reasons import rig_error, sentences
from rig.recorder.feed import StateFeed
from rig.recorder.published import PublishedState
from rig.records import ClockSample, Direction, Drop, Job, Pulse
from rig.session.schema import Reasons, RunState
from rig.session.store import Session

log = logging.getLogger(__name__)
ARM_TIMEOUT_MS = 10_000
_PING_S = 0.37  # mean distance of clock samples: in step with nothing
_ARMED_S = 0.1  # at most, while armed: the device disarms itself when the host is silent
_REFERENCE_S = 10.0  # between two questions for the latest pulse of the reference


class NullSink:
    """What a recorder uses of a session, of a device without one. Nothing is kept: it never arms.

    It has no `add_drop` and no `add_state`: a drop is never forgotten, and a run belongs to a
    session.
    """

    def __getattr__(self, name: str) -> Any:
        if name not in {"log_bytes", "add_identity", "add_timing", "drop", "commit"}:
            raise AttributeError(name)
        return lambda *_args, **_names: None


def arm_order(protocol: Protocol, label: int, timeout_ms: int, record_ms: int) -> Arm:
    """Return the request for a protocol's gates and release; see `Arm` for the rest."""
    mask, release = protocol.gates.mask, protocol.release
    pulse_us = round(release.pulse * 1e6)
    return Arm(label, mask, 1 << release.channel, pulse_us, timeout_ms, record_ms)


class Recorder:
    """The owner of the port and of the session.

    All bytes are put into the session before anything is done with them; a drop is committed before
    the device is told to forget it. No signal may come meanwhile: it is the worker's thread that
    works here.

    Parameters
    ----------
    session
        Open for writing.
    url
        The port.
    published
        Where everything that becomes known is shown.
    halted
        Asked all the time whether everything shall be off.
    meet
        Called with who is there before anything is asked of it; gives what else is known of it.
    port
        What `let_go` returned, with a board that is running; else the port is opened.

    Attributes
    ----------
    feed
        What clients see of it.
    identity
        Who is there.
    armed
        Run and attempt of the drop that waits for `fire`.

    Raises
    ------
    DeviceError
        No such port, nobody there, or another protocol version.
    """

    def __init__(
        self,
        session: Session | NullSink,
        url: str,
        published: PublishedState,
        halted: Callable[[], bool],
        meet: Callable[[Identity], dict[str, str]],
        port: Port | None = None,
    ) -> None:
        self.session = session
        self.feed = StateFeed(published)
        self._halted = halted
        self._uneven = random.Random(0)
        self.armed: Job | None = None
        self._sample: ClockSample | None = None  # the latest
        self._disk_must_not_matter = False
        self._is_endable = False  # whether a request may be left without its answer
        self._port = open_port(url) if port is None else port
        self.clock = port_clock(self._port)
        self._host = HostWatch() if isinstance(self.clock, SystemClock) else None
        self._reference_ns = self.clock.now_ns()  # when to ask for the next pulse
        self.device = Device(self._port, self.clock, self._log, self._note, give_way=self._give_way)
        try:
            with self._endable():
                self.identity = self.device.connect(BOOT_WAIT_S if port is None else 0.0)
            record = self.identity.json() | {"port": told(url)} | meet(self.identity)
            self.session.add_identity(record, self.clock.now_ns())
            self.session.commit()
        except BaseException:
            self.let_go()
            raise

    def let_go(self, *, keep: bool = False) -> Port | None:
        """Make safe (an armed release is disarmed, a recording is left alone); let go of the port.

        Parameters
        ----------
        keep
            Whether the port stays open; that of a board which does not answer is closed.

        Returns
        -------
        Port or None
            The open port, for the next recorder.
        """
        kept = False
        try:
            with suppress(DeviceError):
                if self.armed is not None:
                    self.abort()
                kept = keep
        finally:
            if not kept:
                self._port.close()
        with suppress(SessionError):  # what STOP sent past everything waits in memory
            self.device.log_past()
        self.session.commit()
        return self._port if kept else None

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
        self.session.commit()

    def look(self) -> None:
        """Ask what the device is doing, and let it know that somebody is there."""
        with self._endable():
            self.device.status()

    def ping_gap_s(self) -> float:
        """Return the time to the next clock sample, s: another one each time."""
        return _PING_S * self._uneven.uniform(0.5, 1.5)

    def ping(self) -> None:
        """Take one clock sample, now and then one of the 1 Hz reference; not while armed."""
        if self._host is not None and (gap := self._host.look()) is not None:
            self.session.add_timing(gap)
        with self._endable():
            self._sample = self.device.ping()
            if self.clock.now_ns() >= self._reference_ns:
                self._reference_ns = self.clock.now_ns() + round(_REFERENCE_S * 1e9)
                self.device.reference()

    def statistics(self) -> dict[str, object]:
        """Count what went over the line since it is up, see rig/daemon/API.md."""
        sample = self._sample
        trip_s = (sample.host_recv_ns - sample.host_send_ns) * 1e-9 if sample else None
        return self.device.statistics() | {"round_trip_s": trip_s}

    def arm(self, job: Job, protocol: Protocol) -> int:
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
        order = arm_order(protocol, pack_label(*job), ARM_TIMEOUT_MS, record_ms(protocol))
        try:
            with self._endable():
                token = self.device.arm(order)
        except StoppedError:
            self.abort()  # the device may have heard what it did not answer
            raise
        self.armed = job
        self.state(job, RunState.ARMED)
        return token

    def fire(self, token: int) -> None:
        """Let go. What was armed is on the disk as fired before the request leaves.

        Raises
        ------
        DeviceRefusedError
            Nothing was let go: a beam was disturbed, or the device has disarmed itself.
        """
        job = self.armed or Job(0, 0)
        self.look()  # a slow disk may take most of the silence allowed, twice
        self.state(job, RunState.FIRED)
        self.go_on()  # whoever asked to stop until now sees nothing fall
        try:
            with self._endable():
                self.device.fire(token)
        except (StoppedError, DeviceRefusedError) as ended:
            # A STOP that overtook the answer makes the device refuse the repeated request.
            if isinstance(ended, StoppedError) or self._halted():
                self.abort()  # if it had heard, what fell is collected
            raise
        self.armed = None  # from here on there is a recording, which `let_go` leaves alone

    def collect(self, job: Job, *, fresh: bool = True) -> Drop:
        """Read the drop whole, store it, and only then let the device forget it.

        Parameters
        ----------
        job
            Of the drop.
        fresh
            Whether it has just been let go, so that STOP ends its recording; else it may be in the
            session already, and only the device does not know.

        Raises
        ------
        DeviceError
            The session has another drop of this run and attempt, or the device is in trouble.
        """
        label = pack_label(*job)
        timeout, stop = (None, self._halted) if fresh else (0.0, None)
        drop = self.device.collect(label, timeout, stop)
        stored = self.session.drop(*job)
        if stored is None:
            self.session.add_drop(drop, host_ns=self.clock.now_ns(), provenance="device")
            self.state(job, RunState.RECORDED, drop.faults)
            log.info("%s: recorded, %d edges", job, len(drop.edges))
        elif (stored.certificate, stored.fire_tick) != (drop.certificate, drop.fire_tick):
            raise rig_error("drop_differs", **job._asdict())
        self.feed.show_drop(drop)
        if drop.certificate is not None:
            self.device.acknowledge(label, drop.certificate.crc32)
            self.session.commit()
        return drop

    def abort(self) -> None:
        """Switch everything off, even when the disk does not take the record of it any more."""
        self._disk_must_not_matter = True
        try:
            self.device.abort()
            self.armed = None
        finally:
            self._disk_must_not_matter = False

    def state(self, job: Job, state: RunState, reasons: Reasons = ()) -> None:
        """Log where a run stands, on the disk when this returns."""
        self.session.add_state(*job, state, self.clock.now_ns(), reasons)
        self.session.commit()
        if state is RunState.INTERRUPTED:
            log.info("%s: interrupted: %s", job, sentences(reasons))
        self.feed.state(job, state, reasons)

    def go_on(self) -> None:
        """Go on unless everything shall be off.

        Raises
        ------
        StoppedError
            By a client's STOP, or because the one in control was lost.
        """
        if self._halted():
            raise rig_error("switched_off")

    @contextmanager
    def _endable(self) -> Iterator[None]:
        """Let STOP end what gets no answer: on a bad line a request is repeated for seconds."""
        self._is_endable = True
        try:
            yield
        finally:
            self._is_endable = False

    def _give_way(self) -> None:
        # To ask also tells whoever owns this that the device is waited for.
        if self._halted() and self._is_endable:
            raise rig_error("switched_off")

    def _log(self, direction: Direction, host_ns: int, data: bytes) -> None:
        try:
            self.session.log_bytes(direction, host_ns, data)
        except SessionError:  # the bytes wait in memory, and the next commit says so
            if not self._disk_must_not_matter:
                raise

    def _note(self, record: Record) -> None:
        if isinstance(record, ClockSample | Pulse):
            self.session.add_timing(record)
        self.feed.know(record)
