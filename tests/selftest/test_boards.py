"""A board that is in order passes, and for every check there is one broken in just that way."""

from dataclasses import replace
from functools import partial
from unittest.mock import Mock

import pytest

from rig.errors import DeviceError
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.frames import Frame, encode
from rig.selftest.board import BoardUnderTest, SelftestOptions
from rig.selftest.checks import BAD_ORDERS
from rig.selftest.findings import Verdict
from rig.selftest.run import CHECKS, run_checks, selftest
from sim.controller import Microcontroller
from tests.flash.pty_board import PtyBoard
from tests.link.talk import arm
from tests.refusals import refused
from tests.selftest.benches import GATE, LoopedBoard, hold_drop, outcomes, port_of, wired
from tests.selftest.broken import BROKEN, claims, odd
from tests.tables import cases

HANDS = {"GATE_BLOCKED", "GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}
FENCE = "sim://?protocol=protocols/picket-fence.yaml"


@pytest.fixture
def rig(call):
    return partial(call, "selftest")


def failed(found):
    return [str(outcome) for outcome in found.values() if outcome.verdict is Verdict.FAILED]


@pytest.mark.parametrize("streams", [False, True])
@pytest.mark.parametrize("ppm", [-3000.0, 0.0, 3000.0])
def test_a_good_board_passes(ppm, streams):
    board = LoopedBoard(wired(), seed=2, ppm=ppm, streams=streams)
    found = outcomes(port_of(board))
    assert failed(found) == []
    assert {n for n, o in found.items() if o.verdict is Verdict.NOT_POSSIBLE} == HANDS
    assert board.driven == 1
    assert list(found) == list(CHECKS)


class HeldUp(LoopedBoard):
    """One of its answers is late: this computer had no time."""

    heard = 0

    def receive(self, start_ns, data):
        self.heard += 1
        super().receive(start_ns + 150_000_000 * (self.heard == 60), data)


class Stopped(LoopedBoard):
    """Its emergency stop is open."""

    def __init__(self, lab):
        super().__init__(lab)
        self.stop(True)


def fewer_gates(lab, number=12):
    board = LoopedBoard(lab)
    names = " ".join(board.identity.channels.split()[:number])
    board.identity = replace(board.identity, gates=number, channels=names)
    return board


BOARDS = {"looped": LoopedBoard, "held up": HeldUp, "stopped": Stopped, "12 gates": fewer_gates}


@cases
def test_a_right_rig_fails_nothing_and_is_told_what_it_lacks(
    board, wiring, options, says, monkeypatch
):
    lab = wired(**wiring)
    monkeypatch.setattr("sim.board.Microcontroller", claims(gates=("or_", lab.hanging)))
    board = BOARDS[board](lab)
    found = outcomes(port_of(board), **options)
    assert failed(found) == []
    assert {check: found[check].what[: len(what)] for check, what in says.items()} == says
    assert board.driven == options.get("release", True) * (found["COOLING"].verdict is Verdict.OK)


def test_a_busy_computer_blames_no_board(monkeypatch):
    monkeypatch.setattr("rig.selftest.line_checks._ASK_S", 0.3)
    found = outcomes(port_of(LoopedBoard(wired())))
    assert failed(found) == []
    lacking = "it needs a computer with time to ask the board every 250 ms"
    assert found["arming times out"].what == lacking


@cases
def test_a_gate_in_use_that_is_blocked_or_not_there_fails(
    number, blocked, in_use, code, what, monkeypatch
):
    monkeypatch.setattr("sim.board.Microcontroller", claims(gates=("or_", blocked)))
    board = fewer_gates(wired(blocked=blocked), number)
    gates = outcomes(port_of(board), gates=in_use)["gates"]
    assert (gates.verdict, gates.reason.code, gates.what) == (Verdict.FAILED, code, what)


def test_json_lists_each_check_with_its_codes(rig):
    done = rig("--port", FENCE, "--loopback", "2", "--drops", "1", "--json", code=4)
    listed = {entry.pop("name"): entry for entry in done.json["checks"]}
    assert list(listed) == list(CHECKS)
    assert listed["bad requests"] == {"verdict": "ok", "what": "", "advice": "", "reason_codes": []}
    codes = {name: (entry["verdict"], entry["reason_codes"]) for name, entry in listed.items()}
    events = {"code": "sync_edges", "values": {"gate": 2, "events": 0}}
    assert codes["sync output to gate"] == ("failed", [events])
    needed = {"code": "check_needs", "values": {"needed": "a hand at the emergency stop"}}
    assert codes["STOPPED"] == ("not_possible", [needed])


@pytest.mark.parametrize("port", [FENCE, "sim://", "sim://?seed=3"])
def test_a_protocol_says_which_gates_are_in_use(rig, port):
    lines = rig("--port", port, "--protocol", "protocols/picket-fence.yaml").out.splitlines()
    assert any(line.startswith("gates: ok: ") and "gates clear" in line for line in lines)


def test_behind_a_terminal_in_real_time(rig):
    with PtyBoard() as there:
        rig("--port", there.path)


def test_a_drop_of_a_session_is_left_alone(monkeypatch):
    monkeypatch.setattr("sim.board.Microcontroller", claims(gates=("or_", 1)))
    port = port_of(LoopedBoard(wired()))
    _, label, drop = hold_drop(port, 7)
    results = outcomes(port)
    assert failed(results) == []
    possible = {name for name, finding in results.items() if finding.verdict is Verdict.OK}
    assert possible == {"handshake", "bad requests", "round trips"}
    assert results["RECORDING"].what == "the board holds a drop (run 7, attempt 2)"
    assert results["RECORDING"].reason.values == {"run": 7, "attempt": 2}
    again = Device(port, port.clock)
    again.connect(boot_wait_s=0)
    assert again.fetch(label) == drop
    # No ABORT made it free to be discarded.
    refused(DeviceError, "still holds the drop of run 7", arm, again, label)


def test_a_drop_that_an_earlier_test_left_is_cleared_away():
    port = port_of(LoopedBoard(wired()))
    device, *_ = hold_drop(port, wire.TEST_RUN)
    assert failed(outcomes(port)) == []
    assert device.status().phase is wire.Phase.IDLE


ONLY_HANDS = {"GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}
"""Nothing but somebody at the rig can make these."""


def board_of(kind, monkeypatch):
    monkeypatch.setattr("rig.selftest.line_checks._PINGS", 12)  # enough to see what is odd
    if not (isinstance(kind, type) and issubclass(kind, Microcontroller)):
        return kind(wired()) if isinstance(kind, type) else kind()
    monkeypatch.setattr("sim.board.Microcontroller", kind)
    return LoopedBoard(wired())


def found_by(check, board):
    """Make one check of a board, behind those that find out what the others need."""
    options = SelftestOptions(GATE, 5, True, 0xFFFF)
    checks = {name: CHECKS[name] for name in ("handshake", "round trips", "gates", check)}
    findings = run_checks(checks, BoardUnderTest(port_of(board), options))
    return next(finding for finding in findings if finding.name == check)


@pytest.mark.parametrize(("check", "code", "kind"), BROKEN)
def test_a_broken_board_is_found_out(check, code, kind, monkeypatch):
    finding = found_by(check, board_of(kind, monkeypatch))
    assert finding.verdict is Verdict.FAILED, str(finding)
    assert finding.reason.code == code


def test_each_check_has_a_board_that_fails_it():
    assert {check for check, *_ in BROKEN} == CHECKS.keys() - ONLY_HANDS - {"bad orders"}


@pytest.mark.parametrize(("name", "value"), BAD_ORDERS)
def test_each_bad_order_that_is_accepted_is_found_out(name, value, monkeypatch):
    class Lax(Microcontroller):
        def _arm(self, order):
            answer = super()._arm(order)
            is_bad = answer == wire.Refused(wire.RefusalReason.BAD_PARAMETER, 0)
            # Only the very variant: another bad order may share its one value.
            usual = order.release and (order.pulse_us in {0, 50_000} or name == "pulse_us")
            is_meant = getattr(order, name) == value and (usual or name == "release")
            return wire.Armed(1) if is_bad and is_meant else answer

    finding = found_by("bad orders", board_of(Lax, monkeypatch))
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

    found = outcomes(port_of(odd(LoopedBoard, _listen=listen)(wired())))
    assert {name for name in found if found[name].verdict is Verdict.OK} == {"handshake"}
    assert found["ARMED"].what == "the device did not answer Status()"


def test_what_is_no_message_is_a_failure():
    def listen(self, usual):
        usual()
        if self._last is not None and self._last[0] == wire.CODES[wire.Reference]:
            self.line.send(self._now_ns, encode(Frame(0xF0, 1, 0, b"")))

    found = outcomes(port_of(odd(LoopedBoard, _listen=listen)(wired())))
    assert found["IDLE"].reason.code == "invalid_message"
    assert found["IDLE"].reason.values == {"text": "unknown message code 0xF0"}
    assert found["junk on the line"].verdict is Verdict.OK


def test_a_cable_that_is_pulled_is_said(monkeypatch):
    port = port_of(LoopedBoard(wired()))
    tests = selftest(port, SelftestOptions())
    next(tests)

    monkeypatch.setattr(port, "read", Mock(side_effect=OSError("device disconnected")))
    assert {finding.what for finding in tests if finding.failed} == {
        "connection lost: device disconnected"
    }
