"""What the virtual board decides: the answer to every request, without any timing of its own."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.link import messages as wire
from rig.link.messages import DisarmReason, Phase, RefusalReason

from .recording import Recording
from .release import Release
from .snapshots import take_snapshots

if TYPE_CHECKING:
    import random
    from collections.abc import Callable

    from rig.link.frames import Frame

    from .counter import Counter
    from .inputs import Inputs
    from .interfaces import Lab

_SILENCE_NS = wire.HOST_SILENCE_MS * 10**6


class Coming(NamedTuple):
    """A snapshot the board is going to take."""

    when_ns: int
    tick: int
    state: int


class Microcontroller:
    """The board's state between requests.

    Parameters
    ----------
    lab
        What the gates see.
    counter
        The device's time.
    identity
        What it says it is and can do.
    inputs
        What else it is wired to.
    tokens
        Where tokens come from.
    restarts
        For the certificate: since IDENTIFY.

    Attributes
    ----------
    gates
        Mask of the beams blocked now.
    order
        While armed: the ARM request.
    drop
        While recording or holding.
    coming, end_ns
        While recording: what the gates are going to do, and when the recording ends.
    sense_ns
        While recording: when the release-sense input is going to change, or `None`.
    release
        The outputs.
    """

    def __init__(
        self,
        lab: Lab,
        counter: Counter,
        identity: wire.Identity,
        inputs: Inputs,
        tokens: random.Random,
        restarts: int = 0,
    ) -> None:
        self.gates = 0
        self.order: wire.Arm | None = None
        self.drop: Recording | None = None
        self.coming: deque[Coming] = deque()
        self.end_ns: int | None = None
        self.sense_ns: int | None = None
        self.release = Release()
        self._deadline_ns = 0  # of the arming
        self._heard_ns = 0  # the latest request
        self._reference = wire.ReferencePulse(0, 0)
        self._inputs = inputs
        self._lab = lab
        self._counter = counter
        self._identity = identity
        self._random = tokens
        self._token = 0
        self._changed = 0  # armed gates that moved since ARM
        self._now_ns = 0
        self.restarts = restarts

    @property
    def phase(self) -> Phase:
        """What the board is doing."""
        if self.order is not None:
            return Phase.ARMED
        if self.end_ns is not None:
            return Phase.RECORDING
        return Phase.IDLE if self.drop is None else Phase.HOLDING

    @property
    def lapses_ns(self) -> int:
        """While armed: when it disarms itself if nothing comes."""
        return min(self._deadline_ns, self._heard_ns + _SILENCE_NS)

    def touch(self, gates: int) -> None:
        """Change the beams by hand (arming asks the lab again)."""
        if self.order is not None:
            self._changed |= (self.gates ^ gates) & self.order.gates
        self.gates = gates

    def stop(self, now_ns: int) -> wire.Disarmed | None:
        """Do what the opening of the emergency stop demands; a recording goes on to its end."""
        self.release.off(now_ns, wire.PulseEnd.STOPPED)
        return self._disarm(DisarmReason.STOPPED)

    def heard(self, now_ns: int) -> None:
        """Note that the host is there: any request says so, a repeated or refused one too."""
        self._heard_ns = now_ns

    def lapse(self, now_ns: int) -> wire.Disarmed | None:
        """Disarm, when armed: nothing came."""
        in_time = now_ns < self._deadline_ns
        return self._disarm(DisarmReason.HOST_SILENT if in_time else DisarmReason.TIMEOUT)

    def reference_pulse(self, tick: int) -> None:
        """Count a pulse of the 1 Hz reference."""
        self._reference = wire.ReferencePulse((self._reference.count + 1) % 2**16, tick)

    def _disarm(self, reason: DisarmReason) -> wire.Disarmed | None:
        order, self.order = self.order, None
        return wire.Disarmed(order.label, reason) if order else None

    def answer(self, frame: Frame, now_ns: int) -> wire.DeviceMessage:
        """Execute a request.

        Parameters
        ----------
        frame
            As received.
        now_ns
            When.

        Returns
        -------
        DeviceMessage
            The answer, perhaps a refusal.
        """
        self._now_ns = now_ns
        if frame.type >= 0x80 or wire.TABLE.get(frame.type) in {None, wire.Flash}:
            return wire.Refused(RefusalReason.UNKNOWN_MESSAGE, frame.type)
        try:
            request = wire.unpack(frame.type, frame.payload)
        except wire.MessageError:
            return wire.Refused(RefusalReason.BAD_PARAMETER, 0)
        answers: dict[type, Callable[[Any], wire.DeviceMessage]] = {
            wire.Identify: self._identify,
            wire.Ping: lambda _: wire.Pong(self._counter.tick_at(now_ns)),
            wire.Status: lambda _: self._status(),
            wire.Arm: self._arm,
            wire.Fire: self._fire,
            wire.Abort: lambda _: self._abort(),
            wire.Read: self._read,
            wire.Acknowledge: self._acknowledge,
            wire.Reference: lambda _: self._reference,
        }
        return answers[type(request)](request)

    def _identify(self, request: wire.Identify) -> wire.DeviceMessage:
        version = self._identity.protocol_version
        if request.protocol_version != version:
            return wire.Refused(RefusalReason.VERSION, version)
        self.restarts = 0
        return self._identity

    def _status(self) -> wire.State:
        order = self.order if self.drop is None else self.drop.order
        events = len(self.drop or ())
        return wire.State(self.phase, self.gates, order.label if order else 0, events)

    def _arm(self, order: wire.Arm) -> wire.DeviceMessage:
        held = self.drop
        if self.end_ns is not None:
            return wire.Refused(RefusalReason.BUSY, 0)
        if held is not None and not (held.aborted and held.order.label == order.label):
            return wire.Refused(RefusalReason.HOLDING_A_DROP, held.order.label & 0xFFFF)
        if not (
            order.label
            and 0 < order.gates < 1 << self._identity.gates
            and order.release < 1 << self._identity.releases
            and order.pulse_us <= self._identity.max_pulse_us
            and bool(order.release) == bool(order.pulse_us)
            and order.timeout_ms
            and order.record_ms
        ):
            return wire.Refused(RefusalReason.BAD_PARAMETER, 0)
        if self._inputs.stopped:
            return wire.Refused(RefusalReason.STOPPED, 0)
        if order.release and (wait_ms := self.release.cooling_ms(self._now_ns)):
            return wire.Refused(RefusalReason.COOLING, wait_ms)
        self.gates = self._lab.rest(order.label)
        if blocked := self.gates & order.gates:
            return wire.Refused(RefusalReason.GATE_BLOCKED, blocked)
        self.drop = None
        self.order = order
        self._changed = 0
        self._token = self._random.randrange(1, 2**32)
        self._deadline_ns = self._now_ns + order.timeout_ms * 10**6
        return wire.Armed(self._token)

    def _fire(self, request: wire.Fire) -> wire.DeviceMessage:
        order = self.order
        if order is None:
            return wire.Refused(RefusalReason.NOT_ARMED, 0)
        if request.token != self._token:
            return wire.Refused(RefusalReason.WRONG_TOKEN, 0)
        if self._inputs.stopped:
            return wire.Refused(RefusalReason.STOPPED, 0)
        if blocked := self.gates & order.gates:
            return wire.Refused(RefusalReason.GATE_BLOCKED, blocked)
        if self._changed:
            return wire.Refused(RefusalReason.GATE_UNSTEADY, self._changed)
        tick = self._counter.tick_at(self._now_ns)
        if order.release:  # nothing is on outside of a recording
            pulse_us = min(order.pulse_us, order.record_ms * 1000)
            self.release.pulse(order.release, self._now_ns, pulse_us)
        changes = self._lab.drop(order.label)
        hz = self._counter.hz(self._now_ns)
        snapshots = take_snapshots(changes, order.gates, hz)
        self.coming.extend(
            Coming(self._now_ns + round(s.ticks / hz * 1e9), (tick + s.ticks) % 2**32, s.state)
            for s in snapshots
        )
        self.drop = Recording(order, tick, self._identity)
        self.end_ns = self._now_ns + order.record_ms * 10**6
        if self._inputs.sense_s is not None:
            self.sense_ns = self._now_ns + round(self._inputs.sense_s * 1e9)
        self.order = None
        return wire.Fired(tick)

    def close(self) -> None:
        """End the recording: what the certificate says of the release is known now."""
        self.end_ns = self.sense_ns = None
        self.coming.clear()
        if self.drop is not None:
            self.drop.restarts = self.restarts
            if self.drop.order.release:
                lasted_ns, by = self.release.latest_pulse()
                self.drop.release = round(lasted_ns * 1e-9 * self._identity.tick_hz), by

    def _abort(self) -> wire.DeviceMessage:
        self.order = None
        self.release.off(self._now_ns, wire.PulseEnd.ABORTED)
        if self.drop is not None:
            self.drop.aborted = True
        if self.end_ns is not None:
            self.end_ns = self._now_ns
        return wire.Done()

    def _read(self, request: wire.Read) -> wire.DeviceMessage:
        drop = self._held(request.label)
        if isinstance(drop, wire.Refused):
            return drop
        if request.count == 0:
            return drop.certificate()
        if request.first >= len(drop):
            return wire.Refused(RefusalReason.BAD_PARAMETER, 0)
        if request.first < drop.first_kept:
            return wire.Refused(RefusalReason.NOT_KEPT, drop.first_kept)
        return drop.part(request.first, request.count)

    def _acknowledge(self, request: wire.Acknowledge) -> wire.DeviceMessage:
        drop = self._held(request.label)
        if isinstance(drop, wire.Refused):
            return drop
        if request.crc32 != drop.certificate().crc32:
            return wire.Refused(RefusalReason.WRONG_CRC, 0)
        self.drop = None
        return wire.Done()

    def _held(self, label: int) -> Recording | wire.Refused:
        """Return a label's drop, or why it cannot be given."""
        if self.end_ns is not None:
            return wire.Refused(RefusalReason.BUSY, 0)
        if self.drop is None or self.drop.order.label != label:
            return wire.Refused(RefusalReason.NO_SUCH_DROP, 0)
        return self.drop
