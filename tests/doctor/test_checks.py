"""Each of the doctor's checks of a board and a session, from facts alone."""

import random
import re
from dataclasses import replace
from types import SimpleNamespace

import pytest

from rig.doctor.board import BOARD_CHECKS, BoardFacts, mains_ripple
from rig.doctor.session import check_restarts, check_whole, describe_supply
from rig.link.gatewatch import GateStates
from rig.link.transcript import Restart
from rig.reasons import make_reason
from rig.records import Certificate, ClockSample, Drop, Edge
from rig.selftest.findings import make_check
from sim.board import VirtualBoard
from tests.link.bench import ScriptedLab

HZ = 16_000_000
FLICKER = GateStates(0, 4)
HELD = make_reason("drop_held", run=7, attempt=2)
BLOCKED = make_reason("gates_blocked", gates_listed="gate 1")


def pings(ppm=0.0, trip_ns=1_000_000, count=30):
    tick_ns = 1e9 / (HZ * (1 + ppm * 1e-6))
    starts = [50_000_000 * n + 7_000_000 * (n % 5) for n in range(count)]
    return tuple(
        ClockSample(at, at + trip_ns, round((at + trip_ns / 2) / tick_ns)) for at in starts
    )


BOARD = BoardFacts(
    identity=VirtualBoard(ScriptedLab()).identity,
    shipped="sim",
    pings=pings(),
    states=GateStates(0, 0),
    edges=(),
)


def edges(times_s):
    ticks = [round(time * HZ) for time in times_s]
    return tuple(Edge(tick + 999 * n, 5, n == 0) for tick in ticks for n in (0, 1))


@pytest.mark.parametrize(
    ("check", "facts"),
    [
        *((name, {}) for name in BOARD_CHECKS),
        ("firmware", {"shipped": ""}),
        ("clock", {"pings": pings(ppm=4000)}),
        ("flickering gates", {"edges": BLOCKED}),
    ],
)
def test_what_is_well_needs_no_advice(check, facts):
    finding = make_check(check, BOARD_CHECKS[check], replace(BOARD, **facts))
    assert finding.advice == ""
    assert finding.json()["reason_codes"] == []


@pytest.mark.parametrize(
    ("check", "facts", "says", "advises"),
    [
        ("firmware", {"shipped": "chainrig 9"}, "but chainrig 9", "rig flash"),
        (
            "held drop",
            {"edges": HELD},
            "run 7, attempt 2",
            "rig run",
        ),
        ("clock", {"pings": ()}, "from 0 pings", "cable"),
        ("clock", {"pings": pings(5700, 1000)}, "+5700", "resonator"),
        ("round trip", {"pings": ()}, "no ping", "cable"),
        ("round trip", {"pings": pings(trip_ns=130_000_000)}, "130.0 ms", "busy"),
        ("emergency stop", {"edges": make_reason("refused_stopped")}, "open", "close it"),
        ("blocked gates", {"states": GateStates(0x102, 0)}, "gates 1, 8", "leave it"),
        ("flickering gates", {"states": FLICKER}, "gate 2", "clear the beam"),
        ("flickering gates", {"states": FLICKER, "edges": BLOCKED}, "gate 2", "clear the beam"),
        (
            "flickering gates",
            {"edges": edges([0.1, 0.3])},
            "gate 5 2 times within 1 s",
            "clear the beam",
        ),
        (
            "flickering gates",
            {"edges": edges([n / 100 for n in range(90)])},
            "gate 5 90 times, in step with 100 Hz",
            "lamps",
        ),
    ],
)
def test_what_is_wrong_is_said_with_what_to_do(check, facts, says, advises):
    finding = make_check(check, BOARD_CHECKS[check], replace(BOARD, **facts))
    assert says in finding.what
    assert advises in finding.advice
    assert "\n  do: " in str(finding)
    assert finding.json()["reason_codes"] == [finding.reason.json()]
    assert not re.search(r"[{}]", str(finding))


@pytest.mark.parametrize(
    ("foreign", "troubles", "writer", "says", "advises"),
    [
        ("", [], "", "whole", ""),
        ("", [], "process 7", "whole, being written by process 7", ""),
        ("it is empty", [], "", "empty", "name a"),
        ("", ["9 pages", "more"], "", "damaged: 9 pages", "rig recover s -o"),
    ],
)
def test_a_session_file(foreign, troubles, writer, says, advises):
    snapshot = SimpleNamespace(writer=writer)
    examined = SimpleNamespace(foreign=foreign, troubles=troubles, snapshot=snapshot)
    finding = make_check("session s", check_whole, examined, "s")
    assert says in finding.what
    assert advises in finding.advice
    assert bool(advises) is bool(finding.advice)


@pytest.mark.parametrize("hz", [50, 60, 100, 120])
@pytest.mark.parametrize("jitter_s", [0.0, 3e-4])
def test_the_mains_rhythm_is_found(hz, jitter_s):
    noise = random.Random(hz)
    times = [0.0031 + n / hz + noise.gauss(0, jitter_s) for n in range(hz)]
    assert mains_ripple(times) == hz
    assert mains_ripple(noise.sample(times, hz // 2)) == hz  # half of them missed


@pytest.mark.parametrize("seed", range(20))
def test_chance_is_no_rhythm(seed):
    noise = random.Random(seed)
    assert mains_ripple([noise.random() for _ in range(noise.randrange(1, 200))]) is None


@pytest.mark.parametrize("hz", [37, 55, 80, 173])
def test_another_rhythm_is_not_the_mains(hz):
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
