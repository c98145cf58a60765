"""Every check can fail: for each there is a board that is broken in just that way."""

import pytest

from rig.errors import DeviceError
from rig.link import messages as wire
from rig.link.frames import Frame, encode
from rig.link.messages import RefusalReason
from rig.selftest.board import SelftestOptions
from rig.selftest.findings import Verdict
from rig.selftest.requests import BAD_ORDERS
from rig.selftest.run import CHECKS, selftest
from sim.board import VirtualBoard
from sim.controller import Microcontroller
from tests.selftest.benches import LoopedBoard, Wire, outcomes, port_of
from tests.selftest.broken import BROKEN

HANDS = {"GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}
"""Nothing but somebody at the rig can make these."""


def board_of(kind, monkeypatch):
    if issubclass(kind, VirtualBoard):
        return kind(Wire())
    monkeypatch.setattr("sim.board.Microcontroller", kind)
    return LoopedBoard(Wire())


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_board_is_found_out(name, monkeypatch):
    kind, check, code = BROKEN[name]
    found = outcomes(port_of(board_of(kind, monkeypatch)), gates=0xFFFF)
    assert found[check].verdict is Verdict.FAILED, {n: str(o) for n, o in found.items()}
    assert found[check].reason.code == code


def test_each_check_has_a_board_that_fails_it():
    assert {check for _, check, _ in BROKEN.values()} == CHECKS.keys() - HANDS


@pytest.mark.parametrize("bad", BAD_ORDERS, ids=str)
def test_each_bad_order_that_is_accepted_is_found_out(bad, monkeypatch):
    class Lax(Microcontroller):
        def _arm(self, order):
            answer = super()._arm(order)
            like = all(getattr(order, name) == value for name, value in bad.items())
            # Only the very variant: another bad order may share its one value.
            usual = order.pulse_us in {0, 50_000} or "pulse_us" in bad
            if answer == wire.Refused(RefusalReason.BAD_PARAMETER, 0) and like and usual:
                return wire.Armed(1)
            return answer

    found = outcomes(port_of(board_of(Lax, monkeypatch)))
    assert found["BAD_PARAMETER"].verdict is Verdict.FAILED
    ((name, value),) = bad.items()
    assert found["BAD_PARAMETER"].what == (
        f"Arm with {name} {value} should give Refused(BAD_PARAMETER), but gives Armed(token=1)"
    )


def test_what_a_board_accepts_wrongly_is_not_fired(monkeypatch):
    """Not even when it cannot be disarmed any more: a release might be driven."""
    fired = []

    class Stubborn(Microcontroller):
        def _arm(self, order):
            if order.label == 0:  # a bad order, with a release
                self.order, self._token, self._deadline_ns = order, 1, 2**62
                return wire.Armed(1)
            return super()._arm(order)

        def _abort(self):
            return wire.Done()

        def _fire(self, request):
            if self.order is not None:
                fired.append(self.order.release)
            return super()._fire(request)

        @property
        def lapses_ns(self):
            return 2**62

    found = outcomes(port_of(board_of(Stubborn, monkeypatch)), release=False)
    assert found["BAD_PARAMETER"].verdict is Verdict.FAILED
    assert not any(fired)


def test_a_board_that_falls_silent_ends_the_test(monkeypatch):
    class Dies(LoopedBoard):
        def _listen(self):
            if self._last is not None and self._last[0] == 0x55:
                self._inbox.popleft()
            else:
                super()._listen()

    found = outcomes(port_of(Dies(Wire())))
    assert found["UNKNOWN_MESSAGE"].verdict is Verdict.FAILED
    later = list(found.values())[list(found).index("UNKNOWN_MESSAGE") + 1 :]
    assert {o.verdict for o in later} == {Verdict.NOT_POSSIBLE}
    assert {o.what for o in later} == {"no answer to Status"}


def test_what_is_no_message_is_a_failure(monkeypatch):
    class Mumbles(LoopedBoard):
        def _listen(self):
            super()._listen()
            if self._last is not None and self._last[0] == wire.CODES[wire.Reference]:
                self.line.send(self._now_ns, encode(Frame(0xF0, 1, 0, b"")))

    found = outcomes(port_of(Mumbles(Wire())))
    assert found["every message"].verdict is Verdict.FAILED
    reason = found["every message"].reason
    assert (reason.code, reason.values) == (
        "invalid_message",
        {"text": "unknown message code 0xF0"},
    )
    assert found["junk on the line"].verdict is Verdict.OK


def test_a_cable_that_is_pulled_is_said(monkeypatch):
    port = port_of(LoopedBoard(Wire()))
    tests = selftest(port, port.clock, SelftestOptions())
    next(tests)

    def gone(*_):
        raise OSError("device disconnected")

    monkeypatch.setattr(port, "read", gone)
    with pytest.raises(DeviceError, match="connection lost: device disconnected"):
        list(tests)
