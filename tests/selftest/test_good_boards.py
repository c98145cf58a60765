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
from tests.flash.pty_board import PtyBoard
from tests.selftest.benches import LoopedBoard, Wire, hold_drop, outcomes, port_of
from tests.selftest.broken import claims
from tests.tables import cases

HANDS = {"GATE_BLOCKED", "GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}
FENCE = "sim://?protocol=protocols/picket-fence.yaml"


@pytest.fixture
def rig(capsys):
    def call(*arguments):
        code = main(["selftest", *arguments])
        out, err = capsys.readouterr()
        return code, out.splitlines(), err

    return call


def failed(found):
    return [str(outcome) for outcome in found.values() if outcome.verdict is Verdict.FAILED]


@pytest.mark.parametrize("streams", [False, True])
@pytest.mark.parametrize("ppm", [-3000.0, 0.0, 3000.0])
def test_a_good_board_passes(ppm, streams):
    board = LoopedBoard(Wire(), seed=2, ppm=ppm, streams=streams)
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


TIME = "it needs a computer with time to ask the board every 125 ms"
BOARDS = {"looped": LoopedBoard, "held up": HeldUp, "stopped": Stopped, "12 gates": fewer_gates}


@cases
def test_a_right_rig_fails_nothing_and_is_told_what_it_lacks(
    board, wiring, options, says, monkeypatch
):
    lab = Wire(**wiring)
    controller = claims("gates", lambda gates: gates | lab.blocked)
    monkeypatch.setattr("sim.board.Microcontroller", controller)
    board = BOARDS[board](lab)
    found = outcomes(port_of(board), **options)
    assert failed(found) == []
    assert {check: found[check].what[: len(what)] for check, what in says.items()} == says
    assert board.driven == options.get("release", True) * (found["COOLING"].verdict is Verdict.OK)


def test_a_busy_computer_blames_no_board(monkeypatch):
    monkeypatch.setattr("rig.selftest.line_checks._ASK_S", 0.3)
    found = outcomes(port_of(LoopedBoard(Wire())))
    assert failed(found) == []
    assert found["arming times out"].what == TIME.replace("125", "250")


@cases
def test_a_gate_in_use_that_is_blocked_or_not_there_fails(
    number, blocked, in_use, code, what, monkeypatch
):
    monkeypatch.setattr("sim.board.Microcontroller", claims("gates", lambda gates: gates | blocked))
    board = fewer_gates(Wire(blocked=blocked), number)
    gates = outcomes(port_of(board), gates=in_use)["gates"]
    assert (gates.verdict, gates.reason.code, gates.what) == (Verdict.FAILED, code, what)


def test_json_lists_each_check_with_its_codes(rig):
    code, lines, _ = rig("--port", FENCE, "--loopback", "2", "--drops", "1", "--json")
    assert code == 4
    listed = {entry.pop("name"): entry for entry in json.loads("\n".join(lines))["checks"]}
    assert list(listed) == list(CHECKS)
    assert listed["bad requests"] == {"verdict": "ok", "what": "", "advice": "", "reason_codes": []}
    codes = {name: (entry["verdict"], entry["reason_codes"]) for name, entry in listed.items()}
    events = {"code": "sync_edges", "values": {"gate": 2, "events": 0}}
    assert codes["sync output to gate"] == ("failed", [events])
    needed = {"code": "check_needs", "values": {"needed": "a hand at the emergency stop"}}
    assert codes["STOPPED"] == ("not_possible", [needed])


@pytest.mark.parametrize("port", [FENCE, "sim://", "sim://?seed=3"])
def test_a_protocol_says_which_gates_are_in_use(rig, port):
    code, lines, _ = rig("--port", port, "--protocol", "protocols/picket-fence.yaml")
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


def test_a_drop_of_a_session_is_left_alone(monkeypatch):
    monkeypatch.setattr("sim.board.Microcontroller", claims("gates", lambda gates: gates | 1))
    port = port_of(LoopedBoard(Wire()))
    _, order, drop = hold_drop(port, 7)
    results = outcomes(port)
    assert failed(results) == []
    possible = {name for name, finding in results.items() if finding.verdict is Verdict.OK}
    assert possible == {"handshake", "bad requests", "round trips"}
    assert results["RECORDING"].what == "the board holds a drop (run 7, attempt 2)"
    assert results["RECORDING"].reason.values == {"run": 7, "attempt": 2}
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
