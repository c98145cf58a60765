"""Every check can fail: for each there is a board that is broken in just that way."""

import pytest

from rig.link import messages as wire
from rig.link.frames import Frame, encode
from rig.link.messages import RefusalReason
from rig.selftest.board import SelftestOptions
from rig.selftest.checks import BAD_ORDERS
from rig.selftest.findings import Verdict
from rig.selftest.run import CHECKS, selftest
from sim.controller import Microcontroller
from tests.selftest.benches import GATE, LoopedBoard, Wire, outcomes, port_of
from tests.selftest.broken import BROKEN, odd

HANDS = {"GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}
"""Nothing but somebody at the rig can make these."""


def board_of(kind, monkeypatch):
    if not (isinstance(kind, type) and issubclass(kind, Microcontroller)):
        return kind(Wire()) if isinstance(kind, type) else kind()
    monkeypatch.setattr("sim.board.Microcontroller", kind)
    return LoopedBoard(Wire())


@pytest.mark.parametrize(("check", "code", "kind"), BROKEN)
def test_a_broken_board_is_found_out(check, code, kind, monkeypatch):
    port = port_of(board_of(kind, monkeypatch))
    findings = selftest(port, SelftestOptions(GATE, 5, True, 0xFFFF))
    finding = next(one for one in findings if one.name == check)
    assert finding.verdict is Verdict.FAILED, str(finding)
    assert finding.reason.code == code


def test_each_check_has_a_board_that_fails_it():
    assert {check for check, *_ in BROKEN} == CHECKS.keys() - HANDS - {"bad orders"}


@pytest.mark.parametrize(("name", "value"), BAD_ORDERS)
def test_each_bad_order_that_is_accepted_is_found_out(name, value, monkeypatch):
    class Lax(Microcontroller):
        def _arm(self, order):
            answer = super()._arm(order)
            # Only the very variant: another bad order may share its one value.
            usual = order.pulse_us in {0, 50_000} or name == "pulse_us"
            lax = getattr(order, name) == value and usual and order.release
            if answer == wire.Refused(RefusalReason.BAD_PARAMETER, 0) and (
                lax or name == "release"
            ):
                return wire.Armed(1) if getattr(order, name) == value else answer
            return answer

    finding = outcomes(port_of(board_of(Lax, monkeypatch)))["bad orders"]
    assert finding.verdict is Verdict.FAILED
    assert f"{name}={value}" in finding.what
    assert "should give Refused(reason=BAD_PARAMETER, detail=0), but gives Armed(t" in finding.what


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
    assert found["bad orders"].verdict is Verdict.FAILED
    assert not any(fired)


def test_a_board_that_falls_silent_fails_what_is_left():
    def listen(self, usual):
        return self._inbox.popleft() if self._last and self._last[0] == 0x55 else usual()

    found = outcomes(port_of(odd(LoopedBoard, _listen=listen)(Wire())))
    assert {name for name in found if found[name].verdict is Verdict.OK} == {"handshake"}
    assert found["ARMED"].what == "the device did not answer Status()"


def test_what_is_no_message_is_a_failure():
    def listen(self, usual):
        usual()
        if self._last is not None and self._last[0] == wire.CODES[wire.Reference]:
            self.line.send(self._now_ns, encode(Frame(0xF0, 1, 0, b"")))

    found = outcomes(port_of(odd(LoopedBoard, _listen=listen)(Wire())))
    assert found["IDLE"].reason.code == "invalid_message"
    assert found["IDLE"].reason.values == {"text": "unknown message code 0xF0"}
    assert found["junk on the line"].verdict is Verdict.OK


def test_a_cable_that_is_pulled_is_said(monkeypatch):
    port = port_of(LoopedBoard(Wire()))
    tests = selftest(port, SelftestOptions())
    next(tests)

    def gone(*_):
        raise OSError("device disconnected")

    monkeypatch.setattr(port, "read", gone)
    assert {finding.what for finding in tests if finding.failed} == {
        "connection lost: device disconnected"
    }
