"""Void, marginal, accepted: by limits that can be said in advance, and never a traceback."""

import json
import random
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench.studies.layout_catalogue import KINDS, under
from rig.analysis.identify import pattern_faults
from rig.analysis.result import DropResult
from rig.analysis.session import analyze
from rig.analysis.verdict import _SURE, _air
from rig.errors import InputError
from rig.model.chain import Chain
from rig.protocol.protocol import Accept
from rig.protocol.reader import parse
from rig.reasons import Reason, make_reason, plain_reason
from rig.records import Certificate, Edge
from rig.units import Quantity
from rig.wordings import OPERATOR
from sim.dials import Dials
from tests.analysis.drops import (
    FENCE,
    SCENES,
    SINGLE,
    UNIFORM,
    Case,
    case,
    codes,
    first_run,
    with_dials,
)

MILD = Dials(skew_sd=1e-3)
QUIET = case(UNIFORM, Dials.quiet(), incline=40.0)
IMPACT = {gate.channel for gate in UNIFORM.gates.on("impact")}


def accepting(one: Case, **limits: float) -> Case:
    return replace(one, protocol=replace(one.protocol, accept=Accept(**limits)))


def only_reason(result: DropResult, verdict: str) -> Reason:
    assert result.verdict == verdict
    (reason,) = result.reasons
    return reason


# ---- limits -------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [-1, 1])
def test_skew_beyond_the_limit_is_void_within_its_uncertainty_marginal(sign):
    unit = case(UNIFORM, with_dials(skew_sd=1.0), incline=40.0).truth.release_skew_s
    one = case(UNIFORM, with_dials(skew_sd=sign * 4e-3 / unit), incline=40.0)
    measured = one.analyze().quantities["release_skew_s"]
    assert measured.value == pytest.approx(sign * 4e-3, abs=1e-7)
    expanded = measured.expanded
    for limit, verdict in ((4e-3 - 1e-6, "void"), (4e-3 + 0.99 * expanded, "marginal")):
        reason = only_reason(accepting(one, release_skew=limit).analyze(), verdict)
        assert reason.text.startswith(f"release skew {sign * 4:.2f} ms")
    result = accepting(one, release_skew=4e-3 + 1.01 * expanded).analyze()
    assert (result.verdict, result.reasons) == ("accepted", ())


@pytest.mark.parametrize(("rods", "verdict"), [(16, "accepted"), (17, "void")])
def test_missed_edges_beyond_the_limit_are_void(rods, verdict):
    """5 % of 660 edges are 33: 16 rods' pairs are within, 17 beyond."""
    rng = random.Random(2)
    passages = sorted({(edge[1], edge[3]) for edge in QUIET.truth.edges})
    lost = set(rng.sample(passages, rods))
    kept = [
        edge
        for edge, (_, channel, _, rod) in zip(QUIET.drop.edges, QUIET.truth.edges, strict=True)
        if (channel, rod) not in lost
    ]
    result = QUIET.with_edges(kept).analyze()
    assert result.verdict == verdict
    assert (result.audit.missed, result.audit.spurious) == (2 * rods, 0)
    if verdict == "void":
        text = only_reason(result, "void").text
        assert text == "34 of 660 edges missed (5.2%), limit 5.0%"


def test_faults_of_the_record_are_the_reasons():
    faults = (make_reason("restarted"), make_reason("crc_mismatch"))
    result = replace(QUIET, drop=replace(QUIET.drop, faults=faults)).analyze()
    assert (result.verdict, result.reasons) == ("void", faults)
    assert not result.quantities


@pytest.mark.parametrize("lost", [1, 250])
def test_lost_edges_are_void(lost):
    certificate = Certificate(events=660, crc32=0, overflows=lost)
    result = replace(QUIET, drop=replace(QUIET.drop, certificate=certificate)).analyze()
    reason = only_reason(result, "void")
    assert f"lost {lost} edges" in reason.text
    assert result.audit.lost == lost
    assert not result.quantities


@pytest.mark.parametrize(
    ("count", "most", "code"),
    [("late", 132, "late_stamps"), ("glitches", 13, "short_pulses")],
)
def test_many_late_stamps_and_short_pulses_are_remarked(count, most, code):
    """Of 660 edges a fifth is 132, and a fiftieth 13.2."""
    few, many = (
        replace(QUIET, drop=replace(QUIET.drop, certificate=certificate)).analyze()
        for certificate in (
            Certificate(events=660, crc32=0, **{count: number}) for number in (most, most + 1)
        )
    )
    assert few.verdict == "accepted"
    reason = only_reason(many, "marginal")
    assert (reason.code, str(most + 1) in reason.text) == (code, True)


def test_edges_that_scatter_are_remarked_and_widen_the_uncertainty():
    scene = parse(under(KINDS[2], (0.2, 0.65), (0.18, 0.6)).protocol())
    calm, jittery = (case(scene, with_dials(jitter_sd=sd)).analyze() for sd in (0.0, 3e-4))
    assert calm.verdict == "accepted"
    assert only_reason(jittery, "marginal").code == "scatter"
    assert jittery.scatter > 2.0
    for name, measured in jittery.quantities.items():
        assert measured.u > calm.quantities[name].u
        assert abs(measured.value - calm.quantities[name].value) < measured.expanded


# ---- records of another kind --------------------------------------------------------------------


def upside_down(one: Case) -> list[Edge]:
    return [edge._replace(blocked=not edge.blocked) for edge in one.drop.edges]


def backwards(one: Case) -> list[Edge]:
    last = one.drop.edges[-1].tick
    return [Edge(last - edge.tick, edge.channel, not edge.blocked) for edge in one.drop.edges]


def shuffled_channels(one: Case) -> list[Edge]:
    channels = [edge.channel for edge in one.drop.edges]
    random.Random(1).shuffle(channels)
    return [e._replace(channel=c) for e, c in zip(one.drop.edges, channels, strict=True)]


def shuffled_times(one: Case) -> list[Edge]:
    ticks = [edge.tick for edge in one.drop.edges]
    random.Random(1).shuffle(ticks)
    return [e._replace(tick=t) for e, t in zip(one.drop.edges, ticks, strict=True)]


def gates_the_other_way_up(one: Case) -> list[Edge]:
    channels = sorted({edge.channel for edge in one.drop.edges})
    other = dict(zip(channels, channels[::-1], strict=True))
    return [edge._replace(channel=other[edge.channel]) for edge in one.drop.edges]


def half_the_speed(one: Case) -> list[Edge]:
    return [edge._replace(tick=2 * edge.tick) for edge in one.drop.edges]


def all_at_once(one: Case) -> list[Edge]:
    return [edge._replace(tick=1000) for edge in one.drop.edges]


WRONG = [
    upside_down,
    backwards,
    shuffled_channels,
    shuffled_times,
    gates_the_other_way_up,
    half_the_speed,
    all_at_once,
]


@pytest.mark.parametrize("change", WRONG)
def test_what_is_no_fall_of_this_chain_is_void(change):
    fence, single, uniform = (case(scene, MILD) for scene in (FENCE, SINGLE, UNIFORM))
    assert fence.with_edges(change(fence)).analyze().verdict == "void"
    for one in (single, uniform):
        result = one.with_edges(change(one)).judge()
        assert result.verdict == "void"
        assert result.reasons


def test_sides_plugged_in_the_wrong_way_round_are_void():
    """At 80° the two chains are never more than 10 mm apart."""
    one = case(UNIFORM, MILD, incline=80.0)
    swapped = [edge._replace(channel=(edge.channel + 8) % 16) for edge in one.drop.edges]
    assert one.with_edges(swapped).judge().verdict == "void"


# ---- little to go by ----------------------------------------------------------------------------


def printable(result: DropResult) -> None:
    text = json.dumps(result.json(), allow_nan=False)
    assert json.loads(text)["verdict"] == result.verdict


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("count", [0, 1, 8])
def test_hardly_any_edges_are_void(scene, count):
    one = case(SCENES[scene], MILD)
    result = one.with_edges(one.drop.edges[:count]).analyze()
    assert result.verdict == "void"
    assert set(codes(result)) <= {"few_edges_fit", "no_fall"}
    assert len(result.reasons) == len(one.records)
    assert (result.audit.received, result.audit.matched) == (count, 0)
    assert not result.quantities
    printable(result)


@pytest.mark.parametrize("channel", [gate.channel for gate in UNIFORM.gates.gates[::7]])
def test_a_dead_gate_is_said_and_harms_nothing_but_the_number_of_edges(channel):
    one = case(UNIFORM, MILD, incline=40.0)
    dead = one.with_edges([edge for edge in one.drop.edges if edge.channel != channel])
    lenient = accepting(dead, missed_edges=0.2).analyze()
    printable(lenient)
    assert only_reason(lenient, "marginal").values["channel"] == channel
    assert lenient.quantities.keys() == one.analyze().quantities.keys()
    for name, measured in lenient.quantities.items():
        assert abs(measured.value - getattr(one.truth, name)) < measured.expanded
    result = dead.analyze()
    missed = lenient.audit.missed / (lenient.audit.matched + lenient.audit.missed)
    assert result.verdict == ("void" if missed > 0.05 else "marginal")
    assert f"channel {channel} " in result.reasons[-1].text
    assert result.audit == lenient.audit


@pytest.mark.parametrize(("share", "code"), [(0.59, "few_edges_fit"), (0.61, "no_fall")])
def test_six_in_ten_edges_must_fit_a_fall(share, code):
    identified = SimpleNamespace(shares={"free": share}, fit=None)
    assert pattern_faults(identified)["free"].code == code


@pytest.mark.parametrize("role", ["impact", "free"])
def test_a_dead_side_is_void(role):
    keep = IMPACT if role == "free" else set(range(16)) - IMPACT
    result = accepting(
        QUIET.with_edges([edge for edge in QUIET.drop.edges if edge.channel in keep]),
        missed_edges=1.0,
    ).analyze()
    unlike, dead = result.reasons
    assert [unlike.code, dead.code] == ["few_edges_fit", "side_silent"]
    assert unlike.values["side"] == dead.values["side"] == role
    printable(result)


@pytest.mark.parametrize("scene", SCENES)
def test_one_gate_a_side_gives_a_result_or_says_why_not(scene):
    protocol = SCENES[scene]
    sides = [s for s in (protocol.gates.on("impact"), protocol.gates.on("free")) if s]
    for n in range(len(sides[0])):
        gates = replace(protocol.gates, gates=tuple(side[n] for side in sides))
        one = case(replace(protocol, gates=gates), MILD)
        result = one.analyze()
        printable(result)
        if result.verdict == "void":
            assert scene != "fence"
            assert result.reasons
            assert not result.quantities
            continue
        for name, measured in result.quantities.items():
            assert abs(measured.value - getattr(one.truth, name)) < 1.5 * measured.expanded


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("rods", [1, 2, 3])
def test_a_chain_of_few_rods(scene, rods):
    protocol = SCENES[scene]
    few = {
        name: replace(
            rod_chain,
            chain=Chain(rod_chain.chain.masses[:rods], rod_chain.chain.heights[:rods]),
            widths=rod_chain.widths[:rods],
            diameters=rod_chain.diameters[:rods],
        )
        for name, rod_chain in protocol.chains.items()
    }
    one = case(replace(protocol, chains=few), Dials.quiet())
    result = one.analyze()
    assert result.verdict == "accepted"
    assert result.matches == {n: edge[3] for n, edge in enumerate(one.truth.edges)}
    for name, measured in result.quantities.items():
        assert abs(measured.value - getattr(one.truth, name)) < 0.01 * measured.u
    printable(result)


@pytest.mark.parametrize("scene", SCENES)
def test_what_is_known_exactly_stays_as_it_is(scene):
    protocol = SCENES[scene]
    exact = replace(
        protocol,
        drop=Quantity(protocol.drop.value),
        gravity=Quantity(protocol.gravity.value),
        gates=replace(protocol.gates, height_u=0.0, datum_u=0.0),
        chains={
            name: replace(rod_chain, position_u=0.0, width_u=0.0)
            for name, rod_chain in protocol.chains.items()
        },
    )
    one = case(exact, Dials.quiet(), clock_u=0.0)
    result = one.analyze()
    assert result.verdict == "accepted"
    ours = {"edges", "start height", "side", "single impulses", "beam offsets", "air"}
    ours |= {"contact", "top rod", "swing", "stretch", "late pull"}
    if scene == "fence":
        ours.add("gravity")  # what is measured, so it is never known
    for name, measured in result.quantities.items():
        assert set(measured.budget) <= ours
        assert abs(measured.value - getattr(one.truth, name)) < 0.01 * measured.u
    printable(result)


# ---- sessions -----------------------------------------------------------------------------------


def attempts(*numbers: tuple[int, int]) -> list:
    return [case(SINGLE, MILD, run=run, attempt=attempt).drop for run, attempt in numbers]


def scale(drop):
    return case(SINGLE, MILD).scale


def test_the_last_attempt_counts_and_the_rejected_do_not():
    drops = attempts((2, 1), (1, 2), (1, 1), (3, 1))
    told = []
    found = analyze(
        SINGLE,
        drops,
        scale,
        {(3, 1): [plain_reason("the door slammed", OPERATOR)]},
        lambda *done: told.append(done),
    )
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert [(r.run.number, r.attempt) for r in found.runs] == [(1, 2), (2, 1), (3, 1)]
    assert [(r.run.number, r.attempt) for r in found.superseded] == [(1, 1)]
    rejected = found.runs[2]
    assert (rejected.verdict, rejected.reasons[0].text) == ("rejected", "the door slammed")
    assert [line.n for line in found.summary] == [2]
    assert [line.n for line in found.with_rejected] == [3]
    said = found.json()
    assert said["summary_with_rejected"][0]["n"] == 3
    (first, second), third = ((run.quantities["speed_m_s"] for run in found.runs[:2]), rejected)
    both = [found.summary[0], found.with_rejected[0]]
    values = [first.value, second.value, third.quantities["speed_m_s"].value]
    assert [line.means["speed_m_s"].value for line in both] == pytest.approx(
        [sum(values[:2]) / 2, sum(values) / 3], rel=1e-12
    )


def test_what_was_void_anyway_is_in_no_summary():
    """A rejected run counts in neither summary when its limits would not have let it count."""
    drops = attempts((1, 1), (2, 1))
    broken = replace(drops[1], edges=drops[1].edges[:50])
    found = analyze(
        SINGLE, [drops[0], broken], scale, {(2, 1): [plain_reason("the door slammed", OPERATOR)]}
    )
    assert found.runs[1].verdict == "rejected"
    assert found.with_rejected == ()
    assert "summary_with_rejected" not in found.json()


def test_a_run_that_is_not_planned_or_a_scene_without_gates_is_bad_input():
    drop = replace(attempts((1, 1))[0], run=13)
    with pytest.raises(InputError, match="run 13 is not in the plan, which has 12"):
        analyze(SINGLE, [drop], scale)
    damaged = replace(drop, damage="its bytes say otherwise")
    with pytest.raises(InputError, match="damaged: run 13: its bytes say otherwise; see rig recov"):
        analyze(SINGLE, [damaged], scale)
    with pytest.raises(InputError, match="no gates"):
        analyze(replace(SINGLE, gates=None), [drop], scale)


def test_a_session_of_void_drops_has_no_summary():
    drops = [replace(drop, edges=()) for drop in attempts((1, 1), (2, 1))]
    found = analyze(SINGLE, drops, scale)
    assert [result.verdict for result in found.runs] == ["void", "void"]
    assert found.summary == ()
    assert analyze(SINGLE, [], scale).json() == {"runs": [], "summary": []}
    assert first_run(SINGLE, None) == 1


@pytest.mark.parametrize(("share", "pushed"), [(0.9, False), (1.1, True)])
def test_air_that_pushes_is_told_of_beyond_its_own_uncertainty(share, pushed):
    u = 0.5 * 4.0  # of the unknown in its own units, and one of these
    fit = SimpleNamespace(
        model=SimpleNamespace(
            protocol=UNIFORM,
            unknowns={"drag": slice(0, 1)},
            kappa=lambda _x: -share * _SURE * u,
        ),
        estimate=SimpleNamespace(x=[0.0], inverse=np.array([[0.5]]), sd=[4.0], scatter=1.0),
    )
    assert bool(_air(fit)["air_accelerates"]) == pushed
