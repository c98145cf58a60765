"""A board that is in order passes, and no release is driven unless that is allowed."""

import json
from dataclasses import replace

import pytest

from rig.cli import main
from rig.errors import DeviceError
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.messages import Phase
from rig.selftest.findings import Verdict
from rig.selftest.run import CHECKS
from sim.controller import Microcontroller
from tests.flash.pty_board import PtyBoard
from tests.selftest.benches import LoopedBoard, Wire, hold_drop, outcomes, port_of

HANDS = {"GATE_BLOCKED", "GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}
FENCE = "sim://?protocol=protocols/picket-fence.yaml"


@pytest.fixture
def rig(capsys):
    def call(*arguments):
        code = main(["selftest", *arguments])
        out, err = capsys.readouterr()
        return code, out.splitlines(), err

    return call


class Watched(LoopedBoard):
    """Remembers whether a release was ever on."""

    driven = 0

    def advance(self, until_ns):
        super().advance(until_ns)
        self.driven |= self.outputs()


def failed(found):
    return [str(outcome) for outcome in found.values() if outcome.verdict is Verdict.FAILED]


@pytest.mark.parametrize("streams", [False, True])
@pytest.mark.parametrize("ppm", [-3000.0, 0.0, 3000.0])
def test_a_good_board_passes(ppm, streams):
    board = Watched(Wire(), seed=2, ppm=ppm, streams=streams)
    found = outcomes(port_of(board))
    assert failed(found) == []
    assert {n for n, o in found.items() if o.verdict is Verdict.NOT_POSSIBLE} == HANDS
    assert board.driven == 1
    assert list(found) == list(CHECKS)


def test_a_busy_computer_blames_no_board(monkeypatch):
    monkeypatch.setattr("rig.selftest.line_checks._ASK_S", 0.3)
    found = outcomes(port_of(LoopedBoard(Wire())))
    assert failed(found) == []
    assert "too busy" in found["arming times out"].what


def test_a_computer_that_is_busy_for_a_moment_blames_no_board():
    class HeldUp(LoopedBoard):
        heard = 0

        def receive(self, start_ns, data):
            self.heard += 1
            super().receive(start_ns + 150_000_000 * (self.heard == 60), data)

    found = outcomes(port_of(HeldUp(Wire())))
    assert failed(found) == []
    assert found["round trips"].what == ("this computer was too busy to ask the board every 125 ms")


def test_without_leave_no_release_is_driven():
    board = Watched(Wire())
    found = outcomes(port_of(board), release=False)
    assert failed(found) == []
    assert board.driven == 0
    assert "--release" in found["COOLING"].what


def test_the_latency_is_measured():
    found = outcomes(port_of(LoopedBoard(Wire(late_s=2e-6))))
    assert found["sync output to gate"].what.startswith("5 drops, latency +2.000 µs, scatter 0.000")


def test_what_is_not_wired_is_not_possible_and_no_failure(rig):
    code, lines, err = rig("--port", FENCE)
    assert code == 0, lines
    assert len(lines) == len(CHECKS)
    assert lines[0].startswith("handshake: ok: virtual, sim, id ")
    assert any(line.startswith("sync output to gate: not possible here: ") for line in lines)
    assert not any(": failed" in line for line in lines)
    assert err == ""


def test_a_wire_that_is_not_there_fails(rig):
    code, lines, err = rig("--port", FENCE, "--loopback", "2", "--drops", "1")
    assert code == 4
    assert [line for line in lines if ": failed" in line] == [
        "sync output to gate: failed: FIRE made 0 events at gate 2 instead of one edge"
    ]
    assert err == "do: check the wire from the sync output to gate 2\n1 check failed\n"


def test_json_lists_each_check_with_its_codes(rig):
    code, lines, _ = rig("--port", FENCE, "--loopback", "2", "--drops", "1", "--json")
    assert code == 4
    listed = {entry.pop("name"): entry for entry in json.loads("\n".join(lines))["checks"]}
    assert list(listed) == list(CHECKS)
    assert listed["VERSION"] == {"verdict": "ok", "what": "", "advice": "", "reason_codes": []}
    assert listed["sync output to gate"]["verdict"] == "failed"
    assert listed["sync output to gate"]["reason_codes"] == [
        {"code": "sync_edges", "values": {"gate": 2, "events": 0}}
    ]
    assert listed["STOPPED"]["verdict"] == "not_possible"
    assert listed["STOPPED"]["reason_codes"] == [
        {"code": "check_needs", "values": {"needed": "a hand at the emergency stop"}}
    ]


UNWIRED = 0xFFF0
"""Inputs that nothing holds to ground."""


@pytest.mark.parametrize(
    ("gates", "verdict", "what"),
    [
        (None, Verdict.NOT_POSSIBLE, "gates 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15 blocked all"),
        (0xF, Verdict.OK, "4 gates clear; not in use and blocked: gates 4, 5,"),
        (0x1F, Verdict.FAILED, "gate 4 blocked all the time"),
    ],
)
def test_inputs_without_a_gate_fail_no_rig(gates, verdict, what, unwired):
    results = outcomes(port_of(unwired), gates=gates)
    assert (results["gates"].verdict, results["gates"].what[: len(what)]) == (verdict, what)
    assert failed({name: result for name, result in results.items() if name != "gates"}) == []
    assert results["GATE_BLOCKED"].verdict is Verdict.OK


@pytest.fixture
def unwired(monkeypatch):
    class Lab(Wire):
        def rest(self, label):
            return UNWIRED

    class Open(Microcontroller):
        def _status(self):
            self.gates |= UNWIRED
            return super()._status()

    monkeypatch.setattr("sim.board.Microcontroller", Open)
    return LoopedBoard(Lab())


def test_a_gate_that_the_board_has_not_is_named():
    board = LoopedBoard(Wire())
    names = " ".join(board.identity.channels.split()[:12])
    board.identity = replace(board.identity, gates=12, channels=names)
    gates = outcomes(port_of(board), gates=0x300F)["gates"]
    assert (gates.verdict, gates.reason.code) == (Verdict.FAILED, "gates_not_fitted")
    assert gates.what == "in use, but not on this board: gates 12, 13"


def test_a_bare_board_says_which_wires_let_it_test_more(monkeypatch, unwired):
    monkeypatch.setattr("tests.selftest.test_good_boards.UNWIRED", 0xFFFF)
    results = outcomes(port_of(unwired), loopback=None)
    assert failed(results) == []
    assert "a wire from one gate input to ground" in results["certificate"].what
    assert "--loopback GATE" in results["certificate"].what


def test_a_protocol_says_which_gates_are_in_use(rig):
    code, lines, _ = rig("--port", FENCE, "--protocol", "protocols/picket-fence.yaml")
    assert code == 0
    assert any(line.startswith("gates: ok: ") and "gates clear" in line for line in lines)


@pytest.mark.parametrize("gates", ["", "0,", "0,16", "a"])
def test_gates_are_a_list_of_numbers(rig, gates):
    with pytest.raises(SystemExit, match="2"):
        rig("--port", FENCE, "--gates", gates)


def test_behind_a_terminal_in_real_time(rig):
    with PtyBoard() as there:
        code, lines, _ = rig("--port", there.path)
    assert code == 0, lines


def test_a_drop_of_a_session_is_left_alone():
    port = port_of(LoopedBoard(Wire()))
    _, order, drop = hold_drop(port, 7)
    results = outcomes(port)
    assert failed(results) == []
    assert results["BUSY"].what == "the board holds a drop (run 7, attempt 2)"
    assert results["BUSY"].reason.values == {"run": 7, "attempt": 2}
    assert results["every message"].verdict is Verdict.NOT_POSSIBLE
    assert results["VERSION"].verdict is Verdict.OK
    again = Device(port, port.clock)
    again.connect(boot_wait_s=0)
    assert again.fetch(order["label"]) == drop
    with pytest.raises(DeviceError, match="still holds the drop of run 7"):
        again.arm(wire.Arm(**order))  # no ABORT made it free to be discarded


def test_a_drop_that_an_earlier_test_left_is_cleared_away():
    port = port_of(LoopedBoard(Wire()))
    device, *_ = hold_drop(port, wire.TEST_RUN)
    assert failed(outcomes(port)) == []
    assert device.status().phase is Phase.IDLE


def test_an_open_stop_makes_arming_impossible():
    board = LoopedBoard(Wire())
    board.stop(True)
    found = outcomes(port_of(board))
    assert failed(found) == []
    assert found["ARM and ABORT"].what == "the emergency stop is open"
    assert found["ARM and ABORT"].reason.code == "refused_stopped"
