"""What a session found, in sentences; how it departed from its plan; what each gate saw."""

from __future__ import annotations

import io
import re
import zipfile
from dataclasses import replace

from rig.analysis.result import Audit, DropResult
from rig.measurands import SEPARATION
from rig.protocol import reader
from rig.protocol.plan import runs as planned_runs
from rig.protocol.protocol import Gate, Run
from rig.reasons import plain_reason
from rig.records import Drop, Edge
from rig.report.attachments import zipped
from rig.report.budget import largest, stacks
from rig.report.deviations import NONE, deviations
from rig.report.finding import finding
from rig.report.timeline import timeline
from rig.session.reading import StateEntry
from rig.session.schema import RunState
from rig.units import Quantity
from tests.cli.lab import PROTOCOLS
from tests.report import fake_analysis


def test_a_finding_counts_measures_and_compares():
    two = fake_analysis.two_chains()
    void = sum(one.verdict == "void" for one in two.runs)
    counted, measured, *compared = finding(two).split(". ")
    assert counted == f"84 runs, 84 drops, {void} void"
    assert re.fullmatch(r"Δz from .* cm at 80° to .* cm at 30° .*; V from .* at 30° .*", measured)
    assert " ".join(compared).startswith("With the model ")


def test_what_disagrees_is_named_with_its_size():
    two = fake_analysis.two_chains()
    vague = {"separation_m": 0.05, "speed_m_s": 1.0}
    lines = [
        fake_analysis.compared(
            replace(line, predicted={n: Quantity(line.means[n].value, u) for n, u in vague.items()})
        )
        for line in two.summary
    ]
    assert finding(replace(two, summary=tuple(lines))).endswith(
        "With the model Δz and V agree within U."
    )
    wrong = {**lines[0].predicted, "speed_m_s": Quantity(99.0)}
    lines[0] = fake_analysis.compared(replace(lines[0], predicted=wrong))
    told = finding(replace(two, summary=tuple(lines)))
    error = f"{lines[0].normalized_error('speed_m_s'):.2f}".replace("-", "−")
    assert told.endswith(f"Δz agrees, V disagrees at 1 of 7 (0°: Eₙ {error}) within U.")


def test_a_finding_of_nothing_says_so():
    assert finding(fake_analysis.EMPTY) == "No run was recorded."
    void = DropResult(Run(1, 40.0, "A", "B"), 1, "void", (), Audit(0, 0, 50, 0, 0))
    told = finding(fake_analysis.analysis([void], []))
    assert told == "1 run, 1 drop, 1 void. No mean can be given."
    told = finding(fake_analysis.gravity())
    assert "agrees with the protocol's gravity (Eₙ −0.47)" in told
    assert ". g = " in told  # G is another constant


def test_shares_of_a_budget_add_up():
    two = fake_analysis.two_chains()
    (stack,) = stacks(two, SEPARATION)
    assert sum(stack.shares.values()) == 1.0
    assert largest([stack]) == ["release skew", "beam heights"]


def test_departures_from_the_plan_are_named():
    protocol = reader.read(PROTOCOLS / "single-chain.yaml")
    planned = planned_runs(protocol)
    made = [DropResult(run, 1, "accepted", (), Audit(4, 4, 0, 0, 0)) for run in planned]
    whole = fake_analysis.analysis(made, [])
    assert deviations(protocol, whole, [entry(run.number) for run in planned]) == [NONE]
    parted = replace(
        fake_analysis.analysis([replace(made[0], attempt=2), replace(made[3], verdict="rejected")],
                               []),
        superseded=(replace(made[0], verdict="void"),),
    )  # fmt: skip
    states = [
        entry(4), entry(1),
        StateEntry(1, 1, RunState.INTERRUPTED, 0, (plain_reason("somebody came in"),)),
    ]  # fmt: skip
    last = planned[-1].number
    assert deviations(protocol, parted, states) == [
        f"Not recorded: runs 2–3, 5–{last}.",
        "Run 1 was repeated (attempt 1 was void).",
        "Run 1, attempt 1 was interrupted: somebody came in.",
        "Rejected by the operator: run 4.",
        "Out of the planned order: run 1.",
    ]


def entry(run: int) -> StateEntry:
    return StateEntry(run, 1, RunState.RECORDED, 0, ())


GATES = (Gate(0, 0.06, "impact"), Gate(1, 0.025, "impact"), Gate(8, 0.08, "free"))
EDGES = (Edge(100, 0, True), Edge(200, 0, False), Edge(250, 1, False), Edge(400, 8, True),
         Edge(500, 0, True))  # fmt: skip


def test_a_timeline_has_a_lane_for_each_gate_and_a_bar_for_each_shadow():
    drop = Drop(1, 1, 1000, EDGES, fire_tick=0, initial_state=0b10)
    matches = {0: 0, 1: 0, 2: 0, 3: 0}
    result = DropResult(
        Run(1, 40.0, "A", "B"), 1, "marginal", (), Audit(5, 4, 0, 1, 0), {}, matches
    )
    svg = timeline(GATES, drop, 1000, result)
    assert re.findall(r">(\w+ \d+ mm)<", svg) == ["impact 60 mm", "impact 25 mm", "free 80 mm"]
    bars = re.findall(r'class="blocked" [^>]* d="([^"]*)"', svg)
    # 1280 steps for 500 ms: from 100 to 200 and what is not over; blocked from the start.
    assert bars == ["M256 0h256m768 0h0", "M0 0h640", "M1024 0h256"]
    assert re.findall(r'class="odd" [^>]* d="([^"]*)"', svg) == ["M1280-5v10"]
    assert timeline(GATES, replace(drop, edges=()), 1000, result) == ""


def test_imported_edges_begin_where_they_begin():
    result = DropResult(Run(1, 40.0, "A", None), 1, "void", (), Audit(5, 0, 0, 5, 0))
    late = tuple(edge._replace(tick=edge.tick + 10_000) for edge in EDGES)
    svg = timeline(GATES, Drop(1, 1, 1000, late), 1000, result)
    assert svg.startswith("<svg")
    assert 'd="M0 0h320m' in svg  # 100 of 400 ms
    assert "odd" not in svg  # nothing was fitted, so nothing is odd


def test_the_same_files_are_the_same_bytes():
    files = {"a.csv": "run\n1\n", "b.txt": "Δz\n"}
    assert zipped(files) == zipped(files)
    with zipfile.ZipFile(io.BytesIO(zipped(files))) as archive:
        assert {name: archive.read(name).decode() for name in archive.namelist()} == files
