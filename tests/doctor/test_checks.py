"""Each of the doctor's checks, from facts alone: well, and every way not to be."""

from __future__ import annotations

import random
import re
from dataclasses import replace

import pytest

from rig.doctor import checks
from rig.doctor.checks import mains_ripple
from rig.doctor.facts import BoardFacts, DiskFacts, Owner, PortFacts, SessionFacts
from rig.link.gatewatch import GateStates
from rig.link.restarts import Restart
from rig.records import ClockSample, Edge
from sim.board import VirtualBoard
from tests.link.bench import ScriptedLab

PORT = PortFacts("/dev/ttyACM0", True, True, "dialout", (), modem_manager=False, left_alone=False)
HZ = 16_000_000


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
    held=None,
    states=GateStates(0, 0),
    edges=(),
    watched_s=1.0,
    unwatched="",
)


def edges(gate, times_s):
    found = []
    for tick in (round(time * HZ) for time in times_s):
        found += [Edge(tick, gate, True), Edge(tick + 999, gate, False)]
    return tuple(found)


@pytest.mark.parametrize(
    ("check", "facts"),
    [
        *((c, PORT) for c in (checks.permission, checks.other_owners)),
        (checks.modem_manager, PORT),
        (checks.modem_manager, replace(PORT, modem_manager=True, left_alone=True)),
        *(
            (c, BOARD)
            for c in (
                checks.firmware,
                checks.held_drop,
                checks.clock,
                checks.round_trip,
                checks.emergency_stop,
                checks.stuck_gates,
                checks.flickering_gates,
            )
        ),
        (checks.firmware, replace(BOARD, shipped="")),
        (checks.clock, replace(BOARD, pings=pings(ppm=4000))),
        (checks.flickering_gates, replace(BOARD, edges=None, unwatched="a drop is held")),
        (checks.disk_room, DiskFacts("/lab", 10**9)),
        (checks.session_file, SessionFacts("s", True, "", "", "")),
        (checks.session_file, SessionFacts("s", True, "", "process 7", "")),
    ],
)
def test_what_is_well_needs_no_advice(check, facts):
    assert check(facts).advice == ""
    assert check(facts).json()["reason_codes"] == []


@pytest.mark.parametrize(
    ("check", "facts", "says", "advises"),
    [
        (checks.permission, replace(PORT, exists=False), "no such port", "rig ports"),
        (checks.permission, replace(PORT, usable=False), "the group dialout", "-aG dialout"),
        (checks.permission, replace(PORT, usable=False, group=""), "its group", "-aG dialout"),
        (
            checks.other_owners,
            replace(PORT, owners=(Owner(71, "screen /dev/ttyACM0"),)),
            "screen /dev/ttyACM0 (process 71)",
            "close that program",
        ),
        (
            checks.other_owners,
            replace(PORT, owners=(Owner(72, "rig daemon --port x"),)),
            "process 72",
            "let that daemon do the work",
        ),
        (checks.modem_manager, replace(PORT, modem_manager=True), "restarts", "rig.usb.udev"),
        (
            checks.firmware,
            replace(BOARD, shipped="chainrig 9"),
            "but chainrig 9",
            "rig flash",
        ),
        (checks.held_drop, replace(BOARD, held=(7, 2)), "run 7, attempt 2", "rig run"),
        (checks.clock, replace(BOARD, pings=()), "from 0 pings", "cable"),
        (checks.clock, replace(BOARD, pings=pings(5700, 1000)), "+5700", "resonator"),
        (checks.round_trip, replace(BOARD, pings=()), "no ping", "cable"),
        (
            checks.round_trip,
            replace(BOARD, pings=pings(trip_ns=130_000_000)),
            "130.0 ms",
            "busy",
        ),
        (
            checks.emergency_stop,
            replace(BOARD, edges=None, unwatched="it is open", stopped=True),
            "open",
            "close it",
        ),
        (
            checks.flickering_gates,
            replace(BOARD, states=GateStates(0, 4)),
            "gate 2",
            "clear the beam",
        ),
        (
            checks.stuck_gates,
            replace(BOARD, states=GateStates(0x0102, 0)),
            "gates 1, 8",
            "leave it",
        ),
        (
            checks.flickering_gates,
            replace(BOARD, edges=None, states=GateStates(0, 4)),
            "gate 2",
            "clear the beam",
        ),
        (
            checks.flickering_gates,
            replace(BOARD, edges=edges(5, [0.1, 0.3])),
            "gate 5 2 times within 1 s",
            "clear the beam",
        ),
        (
            checks.flickering_gates,
            replace(BOARD, edges=edges(5, [n / 100 for n in range(90)])),
            "gate 5 90 times, in step with 100 Hz",
            "lamps",
        ),
        (checks.disk_room, DiskFacts("/lab", 10**7), "10 MB free in /lab", "free 200 MB"),
        (checks.session_file, SessionFacts("s", False, "it is empty", "", ""), "empty", "name a"),
        (
            checks.session_file,
            SessionFacts("s", False, "", "", "9 pages"),
            "damaged: 9 pages",
            "rig recover s -o",
        ),
    ],
)
def test_what_is_wrong_is_said_with_what_to_do(check, facts, says, advises):
    finding = check(facts)
    assert says in finding.what
    assert advises in finding.advice
    assert "\n  do: " in str(finding)
    assert finding.json()["reason_codes"] == [finding.reason.json()]
    assert not re.search(r"[{}]", str(finding))


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
    whole = SessionFacts("s", True, "", "", "")
    assert not checks.restarts(whole).advice
    name = "run 3, attempt 1"
    facts = replace(whole, unseen=((name, 128 | 4 | 8),), sunk=(name, 4.96, 4.31))
    found = checks.restarts(facts)
    assert found.what == f"{name}: before it, unseen (brown-out, watchdog)"
    assert "supply shared with the magnets" in found.advice
    assert checks.supply(facts).what == f"at most from 4.96 V to 4.31 V, in {name}"
    twice = replace(whole, restarts=(Restart(1, 0), Restart(2, 0)))
    assert checks.restarts(twice).what == "while nothing fell, 2 times"
