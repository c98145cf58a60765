"""Boards that are broken on purpose, each in one way, and the check that must notice."""

from contextlib import suppress
from dataclasses import replace
from itertools import count

from rig.link import messages as wire
from rig.link.messages import DisarmReason, Phase, RefusalReason
from rig.selftest.board import LABEL, OTHER_LABEL
from sim.controller import Microcontroller
from sim.recording import Recording
from tests.selftest.benches import GATE, LoopedBoard, wired

COUNT = count(1)


def odd(base=Microcontroller, **methods):
    """Make a kind of controller or board; each method is given itself and the usual method."""
    kind = type("Odd", (base,), {})

    def bind(name, method):
        return lambda self, *args: method(self, getattr(super(kind, self), name), *args)

    for name, method in methods.items():
        setattr(kind, name, bind(name, method))
    return kind


def wrong(phase, request, when=lambda self, asked: True):
    """Say DONE to some requests in one phase."""

    def reply(self, usual, frame, now_ns):
        asked = None
        if self.phase is phase and wire.TABLE.get(frame.type) is request:
            with suppress(wire.MessageError):
                asked = wire.unpack(frame.type, frame.payload)
        return wire.Done() if asked and when(self, asked) else usual(frame, now_ns)

    return odd(answer=reply)


def answers(method, kind, **changes):
    """Change fields of one method's answers of a kind, each by a function of what it was."""

    def answer(_, usual, *args):
        right = usual(*args)
        if not isinstance(right, kind):
            return right
        return replace(right, **{name: new(getattr(right, name)) for name, new in changes.items()})

    return odd(**{method: answer})


def claims(name, change):
    """Answer STATUS with one field changed."""
    return answers("_status", wire.State, **{name: change})


def keeping(method, *names):
    """Execute a request, but for what becomes of some attributes."""

    def execute(self, usual, *args):
        before = {name: getattr(self, name) for name in names}
        answer = usual(*args)
        vars(self).update(before)
        return answer

    return odd(**{method: execute})


def patient(reason=None, deadline_ms=0, silence_ms=0):
    """Disarm at another time; for a reason the board says so, and stays armed."""

    class Patient(Microcontroller):
        @property
        def lapses_ns(self):
            deadline_ns = self._deadline_ns + deadline_ms * 10**6
            return min(deadline_ns, self._heard_ns + (250 + silence_ms) * 10**6)

        def lapse(self, now_ns):
            order, disarmed = self.order, super().lapse(now_ns)
            if disarmed.reason is reason:
                self.order, self._heard_ns = order, now_ns + 10**9
                self._deadline_ns = now_ns + 10**10
            return disarmed

    return Patient


def disobeys(request):
    """Execute repeats of one kind of request."""

    def listen(self, usual):
        if self._last is not None and self._last[0] == wire.CODES[request]:
            self._last = None
        usual()

    return odd(LoopedBoard, _listen=listen)


def identified(**fields):
    """Say to be another."""
    return answers("_identify", wire.Identity, **{n: lambda _, v=v: v for n, v in fields.items()})


def bouncing():
    board = LoopedBoard(wired())
    board.lab.changes = [(0.0, GATE, True), (0.001, GATE, False), (0.002, GATE, True)]
    return board


def refusal_disarms(self, usual, order):
    answer = usual(order)
    if answer == wire.Refused(RefusalReason.BAD_PARAMETER, 0):
        self.order = None
    return answer


def never_cools(self, usual, order):
    self.release._off_ns = 0
    return usual(order)


def one_token(self, usual, order):
    answer, self._token = usual(order), 77
    return wire.Armed(77) if isinstance(answer, wire.Armed) else answer


def keeps_tokens(self, usual, order):
    answer = usual(order)
    self.tokens = [*getattr(self, "tokens", []), self._token]
    return answer


def any_of_its_tokens(self, usual, request):
    is_its = request.token in getattr(self, "tokens", [])
    return usual(wire.Fire(self._token) if is_its else request)


def agrees(_, usual, frame, now_ns):
    return usual(frame, now_ns) if frame.type in wire.TABLE else wire.Done()


def any_length(_, usual, frame, now_ns):
    is_ping = frame.type == wire.CODES[wire.Ping]
    return usual(frame._replace(payload=b"") if is_ping else frame, now_ns)


def has_wrong_sum(self, asked):
    return asked.crc32 != self.drop.certificate().crc32


def wrong_certificate(name, change):
    """Certify drops with one field changed."""

    def fire(self, usual, request):
        before, answer = self.drop, usual(request)
        if isinstance(self.drop, Recording) and self.drop is not before:
            right = self.drop.certificate
            self.drop.certificate = lambda: replace(
                right(), **{name: change(getattr(right(), name))}
            )
        return answer

    return odd(_fire=fire)


def answers_seq_zero(self, usual):
    _, data = self._inbox[0]
    if (frames := self._decoder.feed(data)) and frames[0].seq == 0:
        self._send(wire.State(Phase.IDLE, 0, 0, 0))
    usual()


def listens_when_clean(self, usual):
    return self._inbox.popleft() if self._decoder.bad else usual()


def late_answers(_, usual, at_ns, data):
    usual(at_ns + 150_000_000, data)


ODD, STUCK = "wrong_answer", 1 << 6
BROKEN = [
    ("handshake", "device_silent", odd(LoopedBoard, _listen=lambda self, _: self._inbox.popleft())),
    ("handshake", ODD, identified(channels="A B C")),
    ("handshake", ODD, identified(unique_id=bytes(8))),
    ("handshake", ODD, identified(tick_hz=999_999)),
    (
        "handshake",
        ODD,
        answers("_identify", wire.Identity, unique_id=lambda _: next(COUNT).to_bytes(8, "big")),
    ),
    ("bad requests", ODD, odd(_identify=lambda self, *_: self._identity)),
    ("bad requests", ODD, odd(answer=agrees)),
    ("bad requests", ODD, odd(answer=any_length)),
    ("round trips", "slow_answers", odd(LoopedBoard, receive=late_answers)),
    ("round trips", "clock_off", lambda: LoopedBoard(wired(), ppm=20_000)),
    ("gates", "gates_blocked", claims("gates", lambda gates: gates | STUCK)),
    ("gates", "gates_flicker", claims("gates", lambda gates: gates | STUCK * (next(COUNT) % 2))),
    ("GATE_BLOCKED", ODD, claims("gates", lambda gates: gates | STUCK)),
    *(
        ("IDLE", ODD, wrong(Phase.IDLE, kind))
        for kind in (wire.Reference, wire.Fire, wire.Read, wire.Acknowledge)
    ),
    ("ARMED", ODD, wrong(Phase.ARMED, wire.Fire, lambda me, asked: asked.token == me._token ^ 1)),
    ("ARMED", ODD, keeping("_abort", "order")),
    ("ARMED", ODD, odd(_fire=lambda self, usual, _: usual(wire.Fire(self._token)))),
    ("ARMED", ODD, odd(_arm=keeps_tokens, _fire=any_of_its_tokens)),
    ("ARMED", ODD, odd(_arm=one_token)),
    ("ARMED", ODD, odd(_arm=refusal_disarms)),
    ("ARMED", ODD, claims("label", lambda _: 0)),
    ("arming times out", ODD, odd(lapse=lambda self, *_: self._disarm(DisarmReason.HOST_SILENT))),
    ("arming times out", ODD, patient(DisarmReason.TIMEOUT)),
    ("arming times out", ODD, patient(deadline_ms=100)),
    ("arming times out", ODD, patient(deadline_ms=-10)),
    ("arming times out", ODD, patient(deadline_ms=-200)),
    ("a silent host disarms", ODD, patient(DisarmReason.HOST_SILENT)),
    ("a silent host disarms", ODD, patient(silence_ms=60)),
    ("a silent host disarms", ODD, patient(silence_ms=10_000)),
    ("a silent host disarms", ODD, patient(silence_ms=-20)),
    ("repeated frames", ODD, disobeys(wire.Arm)),
    ("repeated frames", ODD, disobeys(wire.Fire)),
    ("repeated frames", ODD, disobeys(wire.Acknowledge)),
    ("repeated frames", ODD, keeping("_acknowledge", "drop")),
    ("junk on the line", ODD, odd(LoopedBoard, _listen=answers_seq_zero)),
    ("junk on the line", "device_silent", odd(LoopedBoard, _listen=listens_when_clean)),
    *(
        ("RECORDING", ODD, wrong(Phase.RECORDING, kind))
        for kind in (wire.Status, wire.Arm, wire.Read, wire.Acknowledge, wire.Fire)
    ),
    ("RECORDING", ODD, keeping("_abort", "end_ns")),
    ("HOLDING", ODD, wrong_certificate("crc32", lambda crc32: crc32 ^ 1)),
    ("HOLDING", ODD, wrong_certificate("gates", lambda gates: gates ^ 1)),
    *(
        ("HOLDING", ODD, wrong(Phase.HOLDING, kind, lambda _, asked: asked.label == OTHER_LABEL))
        for kind in (wire.Arm, wire.Read, wire.Acknowledge)
    ),
    ("HOLDING", ODD, wrong(Phase.HOLDING, wire.Arm, lambda me, _: not me.drop.aborted)),
    (
        "HOLDING",
        ODD,
        wrong(Phase.HOLDING, wire.Arm, lambda me, asked: asked.label == LABEL and me.drop.aborted),
    ),
    ("HOLDING", ODD, wrong(Phase.HOLDING, wire.Read, lambda _, asked: asked.count)),
    ("HOLDING", ODD, answers("_read", wire.DropCertificate, glitches=lambda _: 9)),
    ("HOLDING", ODD, wrong(Phase.HOLDING, wire.Status)),
    ("HOLDING", ODD, wrong(Phase.HOLDING, wire.Acknowledge, has_wrong_sum)),
    ("COOLING", ODD, odd(_arm=never_cools)),
    ("COOLING", ODD, answers("_arm", wire.Refused, detail=lambda _: 10_000)),
    ("COOLING", ODD, answers("_arm", wire.Refused, detail=lambda rest_ms: rest_ms // 2)),
    ("sync output to gate", "sync_late", lambda: LoopedBoard(wired(late_s=20e-6))),
    ("sync output to gate", "sync_edges", bouncing),
    ("sync output to gate", "sync_blocked", claims("gates", lambda gates: gates | 1 << GATE)),
]
"""The check, its code, and a kind of controller or what builds a board."""
