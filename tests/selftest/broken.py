"""Boards that are broken on purpose, each in one way, and the check that must notice."""

from __future__ import annotations

from dataclasses import replace

from rig.link import messages as wire
from rig.link.messages import DisarmReason, Phase, RefusalReason
from sim.controller import Microcontroller
from sim.recording import Recording
from tests.selftest.benches import GATE, LoopedBoard, Wire

BROKEN = {}
"""A controller or a board, the name of the check and its code, by what is wrong."""


def caught_by(check, code="wrong_answer"):
    def remember(kind):
        BROKEN[kind.__name__] = kind, check, code
        return kind

    return remember


def also(answer, when):
    """Make a controller that answers some requests in its own way."""

    class Odd(Microcontroller):
        def answer(self, frame, now_ns):
            usual = super().answer(frame, now_ns)
            request = wire.TABLE.get(frame.type)
            return answer if when(request, usual) else usual

    return Odd


# -- greeting


@caught_by("handshake", "no_answer")
class Silent(LoopedBoard):
    def _listen(self):
        self._inbox.popleft()


@caught_by("handshake")
class Nameless(LoopedBoard):
    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.identity = replace(self.identity, channels="A B C")


@caught_by("VERSION")
class AnyVersion(Microcontroller):
    def _identify(self, request):
        return self._identity


@caught_by("every message")
class NoReference(also(wire.Done(), lambda asked, _: asked is wire.Reference)):
    pass


@caught_by("UNKNOWN_MESSAGE")
class Agreeable(also(wire.Done(), lambda asked, _: asked is None)):
    pass


@caught_by("BAD_PARAMETER by length")
class AnyLength(Microcontroller):
    def answer(self, frame, now_ns):
        if frame.type == wire.CODES[wire.Ping]:
            frame = frame._replace(payload=b"")
        return super().answer(frame, now_ns)


# -- time


@caught_by("round trips", "slow_answers")
class Slow(LoopedBoard):
    def receive(self, start_ns, data):
        super().receive(start_ns + 150_000_000, data)


@caught_by("round trips", "clock_off")
class FastClock(LoopedBoard):
    def __init__(self, *args, **kwargs):
        super().__init__(*args, ppm=20_000, **kwargs)


class Lapses(Microcontroller):
    deadline_ms = silence_ms = 0

    @property
    def lapses_ns(self):
        return min(
            self._deadline_ns + self.deadline_ms * 10**6, self._heard_ns + self._silence_ns()
        )

    def _silence_ns(self):
        return (250 + self.silence_ms) * 10**6


@caught_by("arming times out")
class NamesTheWrongReason(Microcontroller):
    def lapse(self, now_ns):
        return self._disarm(DisarmReason.HOST_SILENT)


@caught_by("a silent host disarms")
class SaysSoAndStaysArmed(Microcontroller):
    def lapse(self, now_ns):
        order = self.order
        said = super().lapse(now_ns)
        if said.reason is DisarmReason.HOST_SILENT:
            self.order, self._heard_ns = order, now_ns + 10**9
        return said


# -- arming


@caught_by("NOT_ARMED")
class FiresAnyTime(Microcontroller):
    def _fire(self, request):
        if self.order is None and self.drop is None:
            return wire.Fired(1)
        return super()._fire(request)


@caught_by("WRONG_TOKEN")
class AnyToken(Microcontroller):
    def _fire(self, request):
        return super()._fire(wire.Fire(self._token))


@caught_by("WRONG_TOKEN")
class OneToken(Microcontroller):
    def _arm(self, order):
        answer = super()._arm(order)
        self._token = 77
        return wire.Armed(77) if isinstance(answer, wire.Armed) else answer


@caught_by("ARM and ABORT")
class StaysArmed(Microcontroller):
    def _abort(self):
        order = self.order
        done = super()._abort()
        self.order = order
        self._heard_ns = self._now_ns
        return done


@caught_by("ARM and ABORT")
class ForgetsItsLabel(Microcontroller):
    def _status(self):
        return replace(super()._status(), label=0)


@caught_by("BAD_PARAMETER")
class ARefusalDisarms(Microcontroller):
    def _arm(self, order):
        answer = super()._arm(order)
        if answer == wire.Refused(RefusalReason.BAD_PARAMETER, 0):
            self.order = None
        return answer


@caught_by("NO_SUCH_DROP")
class AlwaysReads(Microcontroller):
    def _not_held(self, label):
        return None if self.drop else wire.Refused(RefusalReason.NOT_KEPT, 0)


# -- gates


@caught_by("gates", "gates_blocked")
class StuckGate(Microcontroller):
    def _status(self):
        self.gates |= 1 << 6
        return super()._status()


@caught_by("gates", "gates_flicker")
class FlickeringGate(Microcontroller):
    def _status(self):
        self.gates ^= 1 << 6
        return super()._status()


@caught_by("GATE_BLOCKED")
class ArmsBlocked(StuckGate):
    def _arm(self, order):
        return super()._arm(replace(order, gates=order.gates & ~(1 << 6) or 1))


# -- the line


class Forgetful(LoopedBoard):
    """Executes repeats of one kind of request."""

    forgets = wire.Arm

    def _listen(self):
        if self._last is not None and self._last[0] == wire.CODES[self.forgets]:
            self._last = None
        super()._listen()


@caught_by("frames without seq")
class AnswersSeqZero(LoopedBoard):
    def _listen(self):
        _, data = self._inbox[0]
        if (frames := self._decoder.feed(data)) and frames[0].seq == 0:
            self._send(wire.State(Phase.IDLE, 0, 0, 0))
        super()._listen()


@caught_by("junk on the line", "no_answer")
class Sensitive(LoopedBoard):
    def _listen(self):
        if self._decoder.bad:
            self._inbox.popleft()
        else:
            super()._listen()


# -- drops


@caught_by("certificate")
class WrongSum(Microcontroller):
    def _fire(self, request):
        answer = super()._fire(request)
        if isinstance(self.drop, Recording):
            honest = self.drop.certificate
            self.drop.certificate = lambda: replace(honest(), crc32=honest().crc32 ^ 1)
        return answer


@caught_by("BUSY")
class NeverBusy(
    also(
        wire.Refused(RefusalReason.HOLDING_A_DROP, 0),
        lambda _, a: a == wire.Refused(RefusalReason.BUSY, 0),
    )
):
    pass


@caught_by("ABORT of a recording", "no_certificate")
class RecordsOn(Microcontroller):
    def _abort(self):
        end_ns = self.end_ns
        done = super()._abort()
        if end_ns is not None and end_ns - self._now_ns > 10**10:
            self.end_ns = end_ns
        return done


@caught_by("HOLDING_A_DROP")
class DropsTheDrop(Microcontroller):
    def _arm(self, order):
        if self.end_ns is None:
            self.drop = None
        return super()._arm(order)


@caught_by("reading again")
class ReadsAnything(Microcontroller):
    def _read(self, request):
        if request.count and self.drop is not None and request.first >= len(self.drop):
            return self.drop.part(0, 0)
        return super()._read(request)


@caught_by("reading again")
class CertifiesAnew(Microcontroller):
    def _read(self, request):
        answer = super()._read(request)
        if isinstance(answer, wire.DropCertificate):
            return replace(answer, glitches=answer.glitches + 1)
        return answer


@caught_by("ACKNOWLEDGE and WRONG_CRC")
class AnySum(Microcontroller):
    def _acknowledge(self, request):
        held = self.drop.certificate().crc32 if self.drop else 0
        return super()._acknowledge(replace(request, crc32=held))


@caught_by("ACKNOWLEDGE and WRONG_CRC")
class KeepsTheDrop(Microcontroller):
    offended = False

    def _acknowledge(self, request):
        drop = self.drop
        answer = super()._acknowledge(request)
        if answer == wire.Refused(RefusalReason.WRONG_CRC, 0):
            self.offended = True
        elif self.offended:
            self.drop = drop
        return answer


@caught_by("COOLING")
class NeverCools(Microcontroller):
    def _arm(self, order):
        self.release._off_ns = 0
        return super()._arm(order)


# -- the wire


@caught_by("sync output to gate", "sync_late")
class LateStamps(LoopedBoard):
    def __init__(self, lab, *args, **kwargs):
        super().__init__(Wire(late_s=20e-6), *args, **kwargs)


@caught_by("sync output to gate", "sync_edges")
class BouncingOutput(LoopedBoard):
    def __init__(self, lab, *args, **kwargs):
        super().__init__(lab, *args, **kwargs)
        self.lab.changes = [(0.0, GATE, True), (0.001, GATE, False), (0.002, GATE, True)]


@caught_by("sync output to gate", "sync_blocked")
class WireToSupply(Microcontroller):
    def _status(self):
        self.gates |= 1 << GATE
        return super()._status()


# -- boards that differ in a number


for name, kind, check, changes in (
    ("TimesOutLate", Lapses, "arming times out", {"deadline_ms": 100}),
    ("TimesOutEarly", Lapses, "arming times out", {"deadline_ms": -10}),
    ("PatientForTooLong", Lapses, "a silent host disarms", {"silence_ms": 60}),
    ("WaitsForEver", Lapses, "a silent host disarms", {"silence_ms": 10_000}),
    ("Impatient", Lapses, "a silent host disarms", {"silence_ms": -20}),
    ("ArmsTwice", Forgetful, "repeated frames", {"forgets": wire.Arm}),
    ("FiresTwice", Forgetful, "repeated frames", {"forgets": wire.Fire}),
    ("AcknowledgesTwice", Forgetful, "repeated frames", {"forgets": wire.Acknowledge}),
):
    caught_by(check)(type(name, (kind,), changes))
