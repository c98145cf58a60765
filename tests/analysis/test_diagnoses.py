"""Faults of the rig that are found and said, one kind after another, and none where none is."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.studies.layout_catalogue import KINDS, STANDARD, under
from rig.analysis.faults import Premise, Suspects, alike, faults, rods_of, turn
from rig.analysis.result import GOOD
from rig.clock.calibration import TimeScale
from rig.estimate.curves import model_fall
from rig.protocol.protocol import Drag
from rig.protocol.reader import parse
from rig.records import Edge
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import GRADED, HZ, UNIFORM, Case, case, codes, with_dials
from tests.analysis.sessions import MILD


def test_a_chain_that_hangs_a_rod_s_distance_higher_has_no_rod_too_many():
    layout = under(STANDARD, (0.12, 0.3, 0.6), (0.11, 0.4, 0.7))
    stated = parse(layout.protocol())
    pitch = stated.chains["A"].chain.heights[1]
    true = replace(stated, drop=Quantity(stated.drop.value + pitch))
    result = replace(case(true, MILD, incline=40.0), protocol=stated).analyze()
    assert result.verdict == "void"
    assert "rod_count" not in codes(result)
    (named,) = (reason for reason in result.reasons if "log_odds" in reason.values)
    assert named.code == "drop_height"
    assert abs(named.values["size_m"] - pitch) < named.values["U95_m"]


CALM = with_dials(jitter_sd=2e-6, missed=0.01, gate_sd=0.2e-3, rod_sd=0.2e-3)


def braked(side: str, moment: float, jerk: float, rub: float) -> Case:
    """A chain that is slower by a jerk, m/s, or rubs with a deceleration, m/s², from a moment on.

    An edge comes as the chain's height, and what it is behind, reach that of the edge before.
    """
    one, begin = case(UNIFORM, CALM, incline=50.0, seed=3), CALM.delay
    channels = {gate.channel for gate in one.protocol.gates.on(side)}
    fall = model_fall(one.protocol, one.run, side)
    times = np.linspace(0.0, 1.5, 300_001)
    since = np.maximum(times - moment, 0.0)
    heights = fall.heights(times)[0] + jerk * since + 0.5 * rub * since**2

    def later(edge: Edge) -> Edge:
        level = fall.heights(np.array([edge.tick / HZ - begin]))[0]
        when = begin + float(np.interp(-level, -heights, times)[0])
        return edge._replace(tick=round(when * HZ))

    edges = [later(edge) if edge.channel in channels else edge for edge in one.drop.edges]
    return one.with_edges(edges)


@pytest.mark.parametrize(
    ("side", "moment", "jerk", "rub"),
    [("free", 0.35, 0.15, 0.0), ("free", 0.3, 0.0, 0.5), ("impact", 0.35, 0.25, 0.0)],
)
def test_a_chain_that_is_braked_is_named_with_its_moment(side, moment, jerk, rub):
    result = braked(side, moment, jerk, rub).analyze()
    assert result.verdict == "void"
    (named,) = (reason for reason in result.reasons if "log_odds" in reason.values)
    assert (named.code, named.values["side"]) == ("braked", side)
    assert named.values["time_s"] == pytest.approx(moment, abs=0.03)
    assert f"on the {side} side was braked" in named.text


def test_a_chain_braked_before_all_gates_is_a_late_one_that_hung_elsewhere():
    """By a jerk at t₀ it falls gt²/2 − jerk (t − t₀): no edge tells that from a release later."""
    assert "braked" not in codes(braked("free", 0.02, 0.03, 0.0).analyze())


def test_too_few_edges_for_any_fall_are_no_sign_of_fewer_rods():
    """A short chain, of whose three gates one is silent, and the others missed some edges."""
    text = UNIFORM.text.replace("rods: 25", "rods: 4").replace("1165 mm", "145.5 mm")
    above = [f"channel: {channel}," for channel in (4, 5, 6, 7, 11, 12, 13, 14, 15)]
    few = parse("\n".join(line for line in text.split("\n") if not any(map(line.count, above))))
    dials = Dials(skew_sd=1e-3, missed=0.1)
    one = case(few, dials, incline=40.0, seed=5)
    result = one.with_edges([edge for edge in one.drop.edges if edge.channel != 8]).analyze()
    assert codes(result) == ["few_edges_fit", "gate_silent"]


def test_what_looks_the_same_both_ways_is_no_fault():
    for scene in (UNIFORM, GRADED):
        rods = rods_of(scene.chains["A"])
        assert all(map(alike, rods, turn(rods))) == (scene is UNIFORM)


FEW = under(KINDS[2], (0.2, 0.65), (0.18, 0.6))


def test_a_top_rod_that_two_gates_missed_by_chance_still_hangs_there():
    """One thing at each gate, not two: else it would be said with odds of thousands to one."""
    layout = under(STANDARD, (0.2, 0.65), (0.18, 0.6))
    one = case(parse(layout.protocol()), Dials.quiet(), run=9)
    top = {
        number
        for number, (*_, channel, _blocked, rod) in enumerate(one.truth.edges)
        if rod == 24 and channel < 8
    }
    edges = [edge for number, edge in enumerate(one.drop.edges) if number not in top]
    assert len(one.drop.edges) - len(edges) == 4
    assert "rod_count" not in codes(one.with_edges(edges).analyze())


def test_air_that_is_not_as_stated_is_told():
    """The edges tell it, and the motion fits them: but the protocol is wrong."""
    true, stated = 0.08, 0.03
    speed = math.sqrt(UNIFORM.gravity.value / stated)
    windy = replace(UNIFORM, drag=Drag(terminal_speed=Quantity(speed, 0.02 * speed)))
    one = case(UNIFORM, with_dials(drag=true), incline=40.0)
    result = replace(one, protocol=windy).analyze()
    assert result.verdict == "void"
    (reason,) = result.reasons
    assert reason.code == "air"
    assert abs(reason.values["kappa"] - true) < max(2.0 * reason.values["U95"], 1e-3)


def test_impacts_of_a_quite_different_incline_are_remarked():
    """The model may be off by a third of α, so that neighbours are no news."""
    near, far = (case(UNIFORM, Dials.quiet(), incline=true) for true in (50.0, 80.0))
    planned = case(UNIFORM, Dials.quiet(), incline=40.0).run
    assert not replace(near, run=planned).analyze().reasons
    result = replace(far, run=planned).analyze()
    (remark,) = result.reasons
    assert "incline of 80°, not 40°, or the surface is not as stated" in remark.text
    assert result.verdict in GOOD


@pytest.mark.parametrize("share", [-0.02, 0.02])
def test_a_wrong_clock_and_wrong_gravity_cannot_be_told_apart_and_both_are_said(share):
    """A fall from rest in other gravity is the same fall in other time."""
    one = case(parse(FEW.protocol()), Dials.quiet())
    slow = TimeScale(one.scale.hz / (1.0 - share), one.scale.u)
    result = replace(one, scale=slow).analyze()
    # It reads well, but for what it is void: that must not depend on how many were void before.
    late = replace(one, scale=slow).judge()
    assert (late.verdict, late.reasons) == ("void", result.reasons)
    (reason,) = result.reasons
    assert reason.code == "unclear_fault"
    likeliest = {fault["code"] for fault in reason.values["candidates"][:2]}
    assert likeliest == {"clock", "gravity"}


def test_a_post_of_two_gates_may_stand_wrong_and_of_one_it_is_the_gate():
    of = {gate.channel: gate for gate in UNIFORM.gates.on("free")}
    for count in (1, 2):
        gates = (*UNIFORM.gates.on("impact"), *[*of.values()][:count])
        few = UNIFORM.with_gates(gates)
        posts = [
            fault.values(0.01, 0.001)["side"]
            for fault in faults(Premise(few, few.runs()[0], 1.0), Suspects())
            if fault.code == "post"
        ]
        assert sorted(posts) == ["free", "impact"][2 - count :]
