"""Each of the doctor's checks, from facts alone: well, and every way not to be."""

from __future__ import annotations

import random
import re
from dataclasses import replace

import pytest

from rig.doctor import checks
from rig.doctor.checks import mains_ripple
from rig.doctor.gathering import BoardFacts, Owner, PortFacts, SessionFacts
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
)


def edges(gate, times_s):
    found = []
    for tick in (round(time * HZ) for time in times_s):
        found += [Edge(tick, gate, True), Edge(tick + 999, gate, False)]
    return tuple(found)


SESSION = SessionFacts("s")
CHECKS = {
    **checks.PORT_CHECKS,
    **checks.BOARD_CHECKS,
    **checks.SESSION_CHECK,
    **checks.WHOLE_SESSION_CHECKS,
    "disk": checks.disk_room,
}
PERMISSION, OWNERS, MODEM = checks.PORT_CHECKS
FILE = "session {path}"


@pytest.mark.parametrize(
    ("check", "facts"),
    [
        *((name, PORT) for name in checks.PORT_CHECKS),
        *((name, BOARD) for name in checks.BOARD_CHECKS),
        (MODEM, replace(PORT, modem_manager=True, left_alone=True)),
        ("firmware", replace(BOARD, shipped="")),
        ("clock", replace(BOARD, pings=pings(ppm=4000))),
        ("flickering gates", replace(BOARD, edges=None, unwatched="a drop is held")),
        ("disk", ("/lab", 10**9)),
        (FILE, SESSION),
        (FILE, replace(SESSION, writer="process 7")),
        ("restarts", SESSION),
    ],
)
def test_what_is_well_needs_no_advice(check, facts):
    (finding,) = checks.check_all({check: CHECKS[check]}, facts)
    assert finding.advice == ""
    assert finding.json()["reason_codes"] == []


@pytest.mark.parametrize(
    ("check", "facts", "says", "advises"),
    [
        (PERMISSION, replace(PORT, exists=False), "no such port", "rig ports"),
        (PERMISSION, replace(PORT, usable=False), "the group dialout", "-aG dialout"),
        (PERMISSION, replace(PORT, usable=False, group=""), "its group", "-aG dialout"),
        (
            OWNERS,
            replace(PORT, owners=(Owner(71, "screen /dev/ttyACM0"),)),
            "screen /dev/ttyACM0 (process 71)",
            "close that program",
        ),
        (OWNERS, replace(PORT, owners=(Owner(72, "rig daemon"),)), "process 72", "let that daemon"),
        (MODEM, replace(PORT, modem_manager=True), "restarts", "rig.usb.udev"),
        ("firmware", replace(BOARD, shipped="chainrig 9"), "but chainrig 9", "rig flash"),
        ("held drop", replace(BOARD, held=(7, 2)), "run 7, attempt 2", "rig run"),
        ("clock", replace(BOARD, pings=()), "from 0 pings", "cable"),
        ("clock", replace(BOARD, pings=pings(5700, 1000)), "+5700", "resonator"),
        ("round trip", replace(BOARD, pings=()), "no ping", "cable"),
        ("round trip", replace(BOARD, pings=pings(trip_ns=130_000_000)), "130.0 ms", "busy"),
        (
            "emergency stop",
            replace(BOARD, edges=None, unwatched="it is open", stopped=True),
            "open",
            "close it",
        ),
        *(
            ("flickering gates", replace(BOARD, **facts), "gate 2", "clear the beam")
            for facts in (
                {"states": GateStates(0, 4)},
                {"states": GateStates(0, 4), "edges": None},
            )
        ),
        ("blocked gates", replace(BOARD, states=GateStates(0x102, 0)), "gates 1, 8", "leave it"),
        (
            "flickering gates",
            replace(BOARD, edges=edges(5, [0.1, 0.3])),
            "gate 5 2 times within 1 s",
            "clear the beam",
        ),
        (
            "flickering gates",
            replace(BOARD, edges=edges(5, [n / 100 for n in range(90)])),
            "gate 5 90 times, in step with 100 Hz",
            "lamps",
        ),
        ("disk", ("/lab", 10**7), "10 MB free in /lab", "free 200 MB"),
        (FILE, replace(SESSION, foreign="it is empty"), "empty", "name a"),
        (FILE, replace(SESSION, trouble="9 pages"), "damaged: 9 pages", "rig recover s -o"),
    ],
)
def test_what_is_wrong_is_said_with_what_to_do(check, facts, says, advises):
    (finding,) = checks.check_all({check: CHECKS[check]}, facts)
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
    name = "run 3, attempt 1"
    facts = replace(SESSION, unseen=((name, 128 | 4 | 8),), sunk=(name, 4.96, 4.31))
    restarts, supply = checks.check_all(checks.WHOLE_SESSION_CHECKS, facts)
    assert restarts.what == f"{name}: before it, unseen (brown-out, watchdog)"
    assert "supply shared with the magnets" in restarts.advice
    assert supply.what == f"at most from 4.96 V to 4.31 V, in {name}"
    twice = replace(SESSION, restarts=(Restart(1, 0), Restart(2, 0)))
    restarts, _ = checks.check_all(checks.WHOLE_SESSION_CHECKS, twice)
    assert restarts.what == "while nothing fell, 2 times"
