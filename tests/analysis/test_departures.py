"""What the equations do not know: rods off their chain, piles, strikes above the level."""

import math
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.adjust import DONE
from rig.analysis.last_passages import disagreements
from rig.analysis.likeness import ENOUGH, Likeness, likeness
from rig.analysis.result import GOOD, Measured
from rig.analysis.session import Analysis
from rig.protocol.protocol import Contact
from rig.protocol.reader import parse
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import HZ, SINGLE, STATED, UNIFORM, Case, assert_true, case, codes
from tests.analysis.sessions import MILD, analysis, cases

GATES = {gate.channel: gate for gate in UNIFORM.gates.gates}
LOWEST = sorted((gate for gate in GATES.values() if gate.side == "impact"), key=lambda g: g.height)
TOP = UNIFORM.chains["A"].chain.rods - 1
DEPARTURE = 0.4e-3


def moved(one: Case, later) -> Case:
    """The same drop, of which each whole passage comes later; how much, s, may depend on it.

    `later` is given gate, rod, when its edges are, and how long that lasts.
    """
    passages = defaultdict(list)
    for n, (time, channel, _, rod) in enumerate(one.truth.edges):
        if rod >= 0:
            passages[channel, rod].append((time, n))
    edges = list(one.drop.edges)
    for (channel, rod), seen in passages.items():
        if len(seen) == 2:
            (begin, _), (end, _) = seen
            ticks = round(HZ * later(GATES[channel], rod, begin, abs(end - begin)))
            for _, n in seen:
                edges[n] = edges[n]._replace(tick=edges[n].tick + ticks)
    return one.with_edges(edges)


def shaken(one: Case, seed: int) -> Case:
    """Every rod off its chain at every beam by as much as lively strings make it, once one struck.

    When that is and how fast rods pass is taken from the edges themselves.
    """
    rng = np.random.default_rng(seed)
    lowest, width = LOWEST[0].channel, UNIFORM.chains["A"].widths[0]
    struck = max(time for time, at, _, rod in one.truth.edges if (at, rod) == (lowest, 0))

    def later(gate, rod, begin, lasting):
        if gate.side != "impact" or begin < struck or rod == TOP:
            return 0.0
        return DEPARTURE * rng.normal() * lasting / width

    return moved(one, later)


def swinging(one: Case, rate: float) -> Case:
    """The same drop of chains that turn so fast, rad/s: rods above their middle come earlier.

    How fast each passes is taken from the edges themselves.
    """
    chain, drop, gravity = UNIFORM.chains["A"], UNIFORM.drop.value, UNIFORM.gravity.value
    places = np.array(chain.chain.heights)

    def later(gate, rod, _begin, lasting):
        lower = 0.5 * rate**2 * 2.0 * (drop + places[rod] - gate.height) / gravity
        return -lower * (places[rod] - places.mean()) * lasting / chain.widths[0]

    return moved(one, later)


EIGHT = (1, 2, 3, 4, 5, 6, 7, 8)


@pytest.fixture(scope="module")
def straight() -> Analysis:
    return analysis(cases(EIGHT, MILD, 5))


@pytest.fixture(scope="module")
def crooked() -> Analysis:
    return analysis([shaken(one, seed) for seed, one in enumerate(cases(EIGHT, MILD, 5))])


def test_how_far_rods_are_off_is_learned_and_no_other_scale_is_believed_smaller(straight, crooked):
    found = crooked
    assert all(run.verdict in GOOD and run.learned for run in found.runs)
    assert found.joint is not None
    components = found.joint.components
    assert components.departure == pytest.approx(DEPARTURE, rel=0.15)
    # Where chains leave the equations, edges tell no other scale below what is stated.
    assert components.floor == STATED.floor
    # Pulls that happen to be alike show nothing of strings where rods are off their chain.
    assert straight.joint is not None
    assert straight.joint.components.impulse < 0.5 * STATED.impulse
    assert components.impulse >= STATED.impulse
    for one, run, still in zip(cases(EIGHT, MILD, 5), found.runs, straight.runs, strict=True):
        by_itself = one.analyze().quantities["release_skew_s"].u
        skew = run.quantities["release_skew_s"].u
        assert still.quantities["release_skew_s"].u < skew < by_itself
        names = ("separation_m", "speed_m_s", "release_skew_s", "fall_time_s")
        assert_true(run, one.truth, 2.0, names)


def test_chains_that_swing_accuse_nothing_and_their_skew_is_found():
    """A bottom rod at 0.15 m/s: at the end of the fall the chain's ends are a millimetre nearer."""
    one = case(UNIFORM, MILD, incline=40.0)
    result = swinging(one, 0.15 / UNIFORM.chains["A"].chain.length).analyze()
    assert (result.verdict, result.reasons) == ("accepted", ())
    skew = result.quantities["release_skew_s"]
    assert abs(skew.value - one.truth.release_skew_s) < skew.expanded


def test_falls_are_said_to_look_like_the_model_or_not(straight, crooked):
    like, unlike = likeness(straight.joint), likeness(crooked.joint)
    assert like is not None
    assert unlike is not None
    assert (like.like, unlike.like) == (True, False)
    assert like.impulses is not None
    few = dict(straight.joint.degrees) | {"impulse": ENOUGH - 0.1}
    assert likeness(replace(straight.joint, degrees=few)).impulses is None
    assert unlike.json()["departure_m"] == pytest.approx(DEPARTURE, rel=0.15)
    assert unlike.sentence.startswith("Measured positions differ from the model by ")
    assert not Likeness(departure=0.0, impulses=0.2).like
    assert "0.00 mm" not in Likeness(departure=4e-6, impulses=None).sentence
    assert "to 0.03 mm" in Likeness(departure=3e-5, impulses=None).sentence


def without(one: Case, lost: dict[int, int]) -> Case:
    """The same drop, of which some channels see nothing from a rod on."""
    return one.with_edges(
        [
            edge
            for edge, (_, channel, _, rod) in zip(one.drop.edges, one.truth.edges, strict=True)
            if rod < lost.get(channel, TOP + 1)
        ]
    )


@pytest.mark.parametrize("gates", [1, 2])
def test_gates_that_not_all_rods_pass_are_left_out(gates):
    """As if they were not there; each of their edges is named."""
    one = case(UNIFORM, MILD, incline=40.0)
    lost = {gate.channel: 8 + 6 * n for n, gate in enumerate(LOWEST[:gates])}
    blind = without(one, lost)
    result = blind.analyze()
    (reason,) = result.reasons
    assert (result.verdict, reason.code) == ("marginal", "low_gates_miss_rods")
    assert {gate["channel"] for gate in reason.values["at"]} == set(lost)
    left_out = {edge.edge for edge in result.unmatched if edge.kind == "left out"}
    assert left_out == {n for n, edge in enumerate(blind.drop.edges) if edge.channel in lost}
    placed = replace(UNIFORM.gates, gates=tuple(
        gate for gate in UNIFORM.gates.gates if gate.channel not in lost))  # fmt: skip
    without_gates = replace(one, protocol=replace(UNIFORM, gates=placed)).analyze()
    for name, measured in without_gates.quantities.items():
        if not name.endswith(("strike_m", "strike_m_s")):
            found = result.quantities[name]
            # Both end where a step is short enough, from different beginnings.
            assert abs(found.value - measured.value) < DONE * measured.u, name
            assert found.u == pytest.approx(measured.u, rel=0.01), name  # it has two digits


def test_a_fault_is_named_beside_gates_that_are_left_out():
    thicker = replace(UNIFORM.chains["A"], widths=(16e-3,) * (TOP + 1))
    one = case(replace(UNIFORM, chains={**UNIFORM.chains, "A": thicker}), MILD, incline=40.0)
    result = replace(without(one, {LOWEST[0].channel: 8}), protocol=UNIFORM).analyze()
    assert result.verdict == "void"
    assert "thickness" in codes(result)


@pytest.mark.parametrize("lost", [{2: 8}, {0: -1, 1: 8}])
def test_gates_above_others_are_not_left_out_nor_above_dead_ones(lost):
    one = case(UNIFORM, MILD, incline=30.0)  # where a heap may hide rods from the lowest
    result = without(one, {LOWEST[n].channel: rod for n, rod in lost.items()}).analyze()
    assert "low_gates_miss_rods" not in codes(result)
    assert ("gate_silent" in codes(result)) == (0 in lost)
    dead = {edge.kind for edge in result.unmatched if edge.channel == LOWEST[0].channel}
    assert dead <= {"dead gate"} or 0 not in lost


@pytest.mark.parametrize("above", [-0.008, 0.0, 0.012])
def test_at_strike_is_that_much_before_the_level(above):
    """A ballistic way of 12 mm, counted back from the level by hand."""
    contact = Contact(strike=Quantity(above, 1e-4))
    protocol = replace(UNIFORM, contact=contact)
    found = case(protocol, Dials.quiet(), incline=40.0).analyze().quantities
    level, end = found["speed_m_s"].value, found["speed_strike_m_s"].value
    assert end**2 == pytest.approx(level**2 - 2.0 * 9.81 * above, rel=1e-6)
    earlier = (level - end) / 9.81
    free = 9.81 * found["fall_time_s"].value  # the free chain's speed by then
    back = free * earlier - 0.5 * 9.81 * earlier**2
    expected = found["separation_m"].value + back - above
    assert found["separation_strike_m"].value == pytest.approx(expected, abs=2e-6)
    slope = abs(1.0 - free / level)
    more = math.hypot(found["separation_m"].u, slope * math.hypot(1e-4, contact.level.u))
    assert found["separation_strike_m"].u == pytest.approx(more, rel=0.1)


def test_last_passages_are_a_second_opinion():
    for seed in (1, 2):
        one = case(UNIFORM, MILD, incline=40.0, seed=seed)
        found = one.analyze().last_passages
        for name in ("speed_m_s", "separation_raw_m"):
            assert abs(found[name].value - getattr(one.truth, name)) < 4.0 * found[name].u


def test_a_last_leg_that_the_whole_fall_does_not_bear_out_is_remarked():
    whole = {"speed_m_s": Measured(6.92, 0.05), "separation_raw_m": Measured(0.115, 0.0005)}
    for alike in ({}, {"speed_m_s": Measured(6.75, 0.05)}):
        assert not any(disagreements(whole, alike))
    slower, nearer = disagreements(
        whole, {"speed_m_s": Measured(6.4, 0.06), "separation_raw_m": Measured(0.105, 0.0006)}
    )
    assert "V = 6.40 ± 0.12 m/s, the whole fall 6.920 ± 0.098 m/s" in slower.text
    assert "Δz as it fell = 105.0 ± 1.2 mm, the whole fall 115.00 ± 0.98 mm" in nearer.text


@pytest.mark.parametrize("lowest_m", [0.022, 0.034, 0.13, 0.35, 1.078])
def test_all_pulls_that_no_beam_sees_may_come_late_and_the_last_in_any_case(lowest_m):
    """By Eq. 9, from the speeds before and after each strike below the top rod's last passage."""
    gates = [gate for gate in UNIFORM.gates.gates if gate.height >= lowest_m]
    model, *_ = replace(case(UNIFORM), protocol=UNIFORM.with_gates(gates)).model()
    fall, places = model.discrepancy.nominal, np.array(UNIFORM.chains["A"].chain.heights)
    pulls = fall.speed[1:] - fall.hits.arrival
    below = places > places[-1] - lowest_m
    below[-2] = True
    alpha = model.records["impact"].alpha
    assert alpha * model.discrepancy.late_pull == pytest.approx(pulls[below].sum())
    assert model.discrepancy.late_way == pytest.approx(lowest_m)


def test_the_strongest_pulls_that_a_protocol_may_state_are_measured():
    one = case(parse(SINGLE.text.replace("A: {rods", "A: {alpha: 1, rods")), Dials.quiet())
    result = one.analyze()
    assert result.verdict == "accepted"
    assert_true(result, one.truth, names=["speed_m_s"])


def test_late_pulls_are_as_uncertain_as_stated_however_wide_the_last_impulse_is():
    text = f"{SINGLE.text}priors: {{last_impulse: 200 %}}\n"
    model, *_ = replace(case(SINGLE), protocol=parse(text)).model()
    assert model.unknowns.sd[model.unknowns["late"]] == pytest.approx(0.2 * model.alpha)
