"""Each of the doctor's checks of a board and a session, from facts alone."""

import random
import re
from dataclasses import replace

import pytest

from rig.doctor.board import BOARD_CHECKS, mains_ripple
from rig.doctor.session import check_restarts, describe_supply
from rig.link import messages as wire
from rig.link.messages import RefusalReason
from rig.link.transcript import Restart
from rig.records import Certificate, Drop
from rig.selftest.board import BoardUnderTest, SelftestOptions
from rig.selftest.findings import Verdict, make_check
from rig.selftest.run import run_checks
from tests.selftest.benches import LoopedBoard, Wire, hold_drop, port_of
from tests.selftest.broken import claims, odd

HZ = 16_000_000


def findings(board=None, port=None):
    """What the doctor finds on a board, or at a port."""
    port = port or port_of(board)
    checked = run_checks(BOARD_CHECKS, BoardUnderTest(port, SelftestOptions()))
    return {finding.name: finding for finding in checked}


def calm(*changes, **settings):
    """Build a board at which nothing moves, but what the lab is told."""
    (lab := Wire()).changes = list(changes)
    return LoopedBoard(lab, **settings)


def test_a_good_board_is_well_and_nothing_is_driven():
    board = calm()
    found = findings(board)
    assert [str(finding) for finding in found.values() if finding.advice] == []
    assert found["firmware"].what == "sim; none for a virtual comes with rig"
    assert (board.driven, board.outputs()) == (0, 0)


def flicker(gate, times_s, dark_s=0.004):
    return [(time + dark_s * (not on), gate, on) for time in times_s for on in (True, False)]


def stopped():
    board = calm()
    board.stop(True)
    return board


def other_firmware():
    board = calm()
    board.identity = replace(board.identity, board="Arduino Uno", firmware="chainrig 9")
    return board


LIGHT = "stop and flickering gates"


@pytest.mark.parametrize(
    ("make", "check", "says", "advises"),
    [
        (other_firmware, "firmware", "chainrig 9, but chainrig", "rig flash"),
        (lambda: calm(ppm=5650), "round trips", "clock is off by +56", "resonator"),
        (stopped, LIGHT, "open", "close it"),
        (lambda: calm((0.1, 5, True)), LIGHT, "gate 5 1 times within 1 s", "clear the"),
        (
            lambda: calm(*flicker(5, [0.0005 + n / 100 for n in range(90)])),
            LIGHT,
            "gate 5 90 times, in step with 100 Hz",
            "lamps",
        ),
        (
            lambda: calm(*sorted(flicker(5, [0.1], 0.4) + flicker(6, [0.2, 0.3]))),
            LIGHT,
            "gate 5 1 times; gate 6 2 times within 1 s",
            "clear the",
        ),
    ],
)
def test_what_is_wrong_is_said_with_what_to_do(make, check, says, advises):
    finding = findings(make())[check]
    assert says in finding.what
    assert advises in finding.advice
    assert finding.verdict is Verdict.FAILED
    assert "\n  do: " in str(finding)
    assert finding.json()["reason_codes"] == [finding.reason.json()]
    assert not re.search(r"[{}]", str(finding))


@pytest.mark.parametrize("reason", [RefusalReason.GATE_BLOCKED, RefusalReason.GATE_UNSTEADY])
@pytest.mark.parametrize("times", [3, 100])
def test_a_gate_that_forbids_firing_now_and_then_is_tried_again(reason, times, monkeypatch):
    refusals = iter([wire.Refused(reason, 4)] * times)
    restless = odd(_fire=lambda _, usual, request: next(refusals, None) or usual(request))
    monkeypatch.setattr("sim.board.Microcontroller", restless)
    finding = findings(calm())[LIGHT]
    assert (finding.verdict is Verdict.OK) is (times == 3)
    assert times == 3 or finding.reason.code == "gates_flicker"


def test_an_input_without_a_gate_is_a_note(monkeypatch):
    monkeypatch.setattr("sim.board.Microcontroller", claims("gates", lambda gates: gates | 1 << 6))
    board = LoopedBoard(Wire(None, blocked=1 << 6))
    found = findings(board)
    assert found["gates"].verdict is Verdict.NOT_POSSIBLE
    assert found["gates"].what.endswith("gate 6 blocked all the time")
    assert found[LIGHT].what == "none within 1 s"


def test_a_drop_of_a_session_is_not_touched():
    port = port_of(calm())
    device, order, drop = hold_drop(port, 3)
    found = findings(port=port)
    assert found["held drop"].reason.values == {"run": 3, "attempt": 2}
    assert "rig run" in found["held drop"].advice
    assert found[LIGHT].verdict is Verdict.NOT_POSSIBLE
    assert device.fetch(order["label"]) == drop


@pytest.mark.parametrize("hz", [50, 60, 100, 120])
@pytest.mark.parametrize("jitter_s", [0.0, 3e-4])
def test_the_mains_rhythm_is_found(hz, jitter_s):
    noise = random.Random(hz)
    times = [0.0031 + n / hz + noise.gauss(0, jitter_s) for n in range(hz)]
    assert mains_ripple(times) == hz
    assert mains_ripple(noise.sample(times, hz // 2)) == hz  # half of them missed


def test_chance_and_other_rhythms_are_not_the_mains():
    for seed in range(20):
        noise = random.Random(seed)
        assert mains_ripple([noise.random() for _ in range(noise.randrange(1, 200))]) is None
    for hz in (37, 55, 80, 173):
        assert mains_ripple([n / hz for n in range(hz)]) is None


def test_restarts_that_only_certificates_tell_of_and_a_supply_that_sinks():
    name = "run 3, attempt 1"
    seen = Certificate(0, 0, restarts=128 | 4 | 8, supply_mv=4960, lowest_mv=4310)
    drops = [Drop(3, 1, HZ, (), certificate=seen), Drop(4, 1, HZ, ())]
    restarts = make_check("restarts", check_restarts, [], drops)
    assert restarts.what == f"{name}: before it, unseen (brown-out, watchdog)"
    assert "supply shared with the magnets" in restarts.advice
    assert describe_supply(drops) == f"at most from 4.96 V to 4.31 V, in {name}"
    assert (check_restarts([], drops[1:]), describe_supply(drops[1:])) == ("none", "not measured")
    twice = make_check("restarts", check_restarts, [Restart(1, 0), Restart(2, 0)], [])
    assert twice.what == "while nothing fell, 2 times"
