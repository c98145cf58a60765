"""What a session found, in sentences; how it departed from its plan; what each gate saw."""

import re
from dataclasses import replace
from types import SimpleNamespace

from rig.analysis.result import Measured
from rig.protocol import reader
from rig.protocol.protocol import Gate, Run
from rig.reasons import OPERATOR, SENTENCE, WORDINGS, Severity, make_reason, plain_reason, remedies
from rig.records import Drop, Edge
from rig.report.finding import NONE, deviations, finding, headline, verdict
from rig.report.templates import lines
from rig.report.timeline import lanes, timeline
from rig.session.reading import StateEntry
from rig.session.schema import RunState
from rig.units import Quantity
from tests.analysis.drops import made_up
from tests.cli.lab import PROTOCOLS
from tests.report import fake_analysis


def test_a_finding_counts_measures_and_compares():
    two = fake_analysis.two_chains()
    void = sum(drop.verdict == "void" for drop in two.runs)
    counted, _, rest = finding(two).partition(": ")
    measured, *compared = rest.split(". ")
    assert counted == f"84 runs, 84 drops, {void} void"
    assert re.fullmatch(
        r"separation Δz at 30° = .* cm; .* at 80° = .* cm; .* V at 30° .*", measured
    )
    assert ". ".join(compared) == verdict(two.summary).sentence


def vague(line, **u):
    predicted = {name: Quantity(line.means[name].value, size) for name, size in u.items()}
    return fake_analysis.compared(replace(line, predicted=predicted))


def test_what_disagrees_is_named_with_its_size():
    summary = fake_analysis.two_chains().summary
    lines = [vague(line, separation_m=0.05, speed_m_s=1.0) for line in summary]
    assert verdict(lines) == ("Δz and V agree with the model at all 7 inclines, within U.", True)
    assert " in both means," in verdict([lines[0], lines[0]]).sentence  # of unlike chains
    wrong = {**lines[0].predicted, "speed_m_s": Quantity(99.0)}
    lines[0] = fake_analysis.compared(replace(lines[0], predicted=wrong))
    sentence, agrees = verdict(lines)
    assert not agrees
    size = 1e3 * abs(lines[0].differences["speed_m_s"].value)
    assert sentence.startswith("V differs from the model at 1 of 7 inclines: V at 0° by ")
    assert f"by {size:.1f} mm/s, where ± " in sentence
    assert sentence.endswith(" would be normal.")
    assert "no prediction" in verdict([replace(lines[0], differences={})]).sentence


def test_a_card_has_at_most_three_numbers():
    two = headline(fake_analysis.two_chains().summary)
    places = ["separation Δz at 30°", "separation Δz at 80°", "end speed V at 30°"]
    assert [number.words for number in two] == places
    gravity = headline(fake_analysis.gravity().summary)
    assert [number.unit for number in gravity] == ["m/s²", "mm/s²"]


def test_a_finding_of_nothing_says_so():
    assert finding(fake_analysis.EMPTY) == "No run was recorded."
    told = finding(fake_analysis.analysis([void(1, 1)], []))
    assert told == "1 run, 1 drop, 1 void. No mean can be given."
    told = finding(fake_analysis.gravity())
    assert told.endswith("g agrees with the protocol's gravity, within U.")
    assert ": g = " in told  # G is another constant


def test_departures_from_the_plan_are_named():
    protocol = reader.read(PROTOCOLS / "single-chain.yaml")
    planned = protocol.runs()
    made = [made_up(run) for run in planned]
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
    result = replace(void(1, 1), rods=(0, 0, 0, 0, -1))
    shared = lanes(GATES, [(drop, 1000, result)])
    assert [gate.channel for gate in shared.gates] == [0, 1, 8]  # from the top, impact first
    # 1280 steps for 500 ms: from 100 to 200 and what is not over; blocked from the start.
    bars = "M0 15m256 0h256m768 0h1M0 45m0 0h640M0 75m1024 0h256"
    assert timeline(shared, (drop, 1000, result))[1:] == (bars, "M1280 15m0-10v20")
    assert timeline(shared, (replace(drop, edges=()), 1000, result))[1:] == ("", "")


def test_imported_edges_begin_where_they_begin():
    late = Drop(1, 1, 1000, tuple(edge._replace(tick=edge.tick + 10_000) for edge in EDGES))
    drop = late, 1000, void(1, 1)
    drawn = timeline(lanes(GATES, [drop]), drop)
    assert drawn.bars.startswith("M0 15m0 0h320m")  # 100 of 400 ms
    assert not drawn.odd  # nothing was fitted, so nothing is odd


def void(run, attempt, *reasons, verdict="void"):
    drop = made_up(Run(run, 40.0, "A", "B"), verdict)
    return replace(drop, attempt=attempt, reasons=reasons)


SKEW = make_reason("release_skew", skew_s=9.19e-3, limit_s=5e-3)
MOTHS = plain_reason("moths")


def test_each_void_has_a_remedy_and_the_general_one_only_where_nothing_else_is_known():
    known = {code: row.remedy for code, row in WORDINGS.items() if row.severity is Severity.VOID}
    assert [code for code, remedy in known.items() if not remedy] == [OPERATOR]
    assert [code for code, remedy in known.items() if remedy == WORDINGS["scatter"].remedy] == [
        SENTENCE
    ]
    (general,) = remedies([MOTHS, plain_reason("a lorry")])
    assert remedies([MOTHS, SKEW, SKEW]) == remedies([SKEW]) != [general]


def test_air_that_may_be_none_is_not_mentioned():
    for nothing in (None, Measured(3e-6, 1e-6), Measured(-3e-6, 1e-6)):
        assert lines("air", SimpleNamespace(rig=nothing and SimpleNamespace(drag=nothing))) == []


def test_air_is_said_with_its_uncertainty():
    (line,) = lines("air", SimpleNamespace(rig=SimpleNamespace(drag=Measured(0.0312345, 1e-5))))
    assert "κ = 0.031234 ± 0.000020 per m" in line
