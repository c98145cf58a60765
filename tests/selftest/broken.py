"""Boards that are broken on purpose, each in one way (`broken.yaml`), and what makes them."""

import operator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import count

from rig.link import messages as wire
from rig.link.messages import DisarmReason, Phase, RefusalReason
from rig.selftest.board import LABEL, OTHER_LABEL
from sim.controller import Microcontroller
from sim.recording import Recording
from tests.selftest.benches import LoopedBoard, wired
from tests.tables import read_table

COUNT = count(1)
OPERATORS = vars(operator) | {
    "set": lambda _, new: new,
    "another": lambda *_: next(COUNT).to_bytes(8, "big"),
    "flicker": lambda value, bit: value | bit * (next(COUNT) % 2),
}
WHEN = {
    "": lambda *_: True,
    "nearly_its_token": lambda me, asked: asked.token == me._token ^ 1,
    "of_another_drop": lambda _, asked: asked.label == OTHER_LABEL,
    "before_an_abort": lambda me, _: not me.drop.aborted,
    "of_its_aborted_drop": lambda me, asked: asked.label == LABEL and me.drop.aborted,
    "of_events": lambda _, asked: asked.count,
    "of_a_wrong_sum": lambda me, asked: asked.crc32 != me.drop.certificate().crc32,
}


def odd(base=Microcontroller, **methods):
    """Make a kind of controller or board; each method is given itself and the usual method."""
    kind = type("Odd", (base,), {})

    def bind(name, method):
        return lambda self, *args: method(self, getattr(super(kind, self), name), *args)

    for name, method in methods.items():
        setattr(kind, name, bind(name, method))
    return kind


def controller(base=Microcontroller, **methods):
    """Make a kind of controller of functions below."""
    return odd(base, **{method: globals()[name] for method, name in methods.items()})


board = partial(controller, LoopedBoard)


def looped(changes=(), ppm=0.0, **wiring):
    (lab := wired(**wiring)).changes += map(tuple, changes)
    return lambda: LoopedBoard(lab, ppm=ppm)


def wrong(phase, request, when=""):
    """Say DONE to some requests in one phase."""

    def reply(self, usual, frame, now_ns):
        asked = None
        if self.phase is Phase[phase] and wire.TABLE.get(frame.type) is getattr(wire, request):
            with suppress(wire.MessageError):
                asked = wire.unpack(frame.type, frame.payload)
        return wire.Done() if asked and WHEN[when](self, asked) else usual(frame, now_ns)

    return odd(answer=reply)


def altered(message, kind, changes):
    """Change fields of a message of a kind, each by an operator and a value."""
    if not isinstance(message, getattr(wire, kind)):
        return message
    values = {n: OPERATORS[how](getattr(message, n), by) for n, (how, by) in changes.items()}
    return replace(message, **values)


def answers(method, kind, **changes):
    """Change fields of one method's answers of a kind."""
    return odd(**{method: lambda _, usual, *args: altered(usual(*args), kind, changes)})


claims = partial(answers, "_status", "State")


def keeping(method, name):
    """Execute a request, but for what becomes of an attribute."""

    def execute(self, usual, *args):
        before = getattr(self, name)
        answer = usual(*args)
        setattr(self, name, before)
        return answer

    return odd(**{method: execute})


def patient(reason="", deadline_ms=0, silence_ms=0):
    """Disarm at another time; for a reason the board says so, and stays armed."""

    class Patient(Microcontroller):
        @property
        def lapses_ns(self):
            deadline_ns = self._deadline_ns + deadline_ms * 10**6
            return min(deadline_ns, self._heard_ns + (250 + silence_ms) * 10**6)

        def lapse(self, now_ns):
            order, disarmed = self.order, super().lapse(now_ns)
            if disarmed.reason.name == reason:
                self.order, self._heard_ns = order, now_ns + 10**9
                self._deadline_ns = now_ns + 10**10
            return disarmed

    return Patient


def disobeys(request):
    """Execute repeats of one kind of request."""

    def listen(self, usual):
        if self._last is not None and self._last[0] == wire.CODES[getattr(wire, request)]:
            self._last = None
        usual()

    return odd(LoopedBoard, _listen=listen)


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


def certifies(**changes):
    """Certify drops with fields changed."""

    def fire(self, usual, request):
        before, answer = self.drop, usual(request)
        if isinstance(self.drop, Recording) and self.drop is not before:
            right = self.drop.certificate
            self.drop.certificate = lambda: altered(right(), "DropCertificate", changes)
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


def hears_nothing(self, _):
    self._inbox.popleft()


def repeats_its_identity(self, *_):
    return self._identity


def any_token(self, usual, _):
    return usual(wire.Fire(self._token))


def blames_the_host(self, *_):
    return self._disarm(DisarmReason.HOST_SILENT)


BROKEN = [
    (check, code, globals()[maker](**arguments))
    for check, code, maker, arguments in read_table(__file__, "broken")
]
"""The check, its code, and a kind of controller or what builds a board."""
