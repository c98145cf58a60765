"""Rods that lie where others strike: their heap by geometry, and drops of the resolved world."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.chain_records import heap_heights, on_heap, strike_heights
from rig.analysis.drop import DropCase, Passages, fit_drop
from rig.bench.falls import Asked, falls, time_scale
from rig.model.surface import Surface
from rig.protocol.plan import runs as planned
from rig.units import Quantity
from tests.analysis.drops import GRADED, PROTOCOLS, SINGLE, UNIFORM, codes

SEED = 3
CHAIN = UNIFORM.chains["A"]
SURFACE = UNIFORM.surface
RUNS = {run.number: run for run in planned(UNIFORM)}


def at(incline: float) -> int:
    """The first planned run at an incline."""
    return next(number for number, run in RUNS.items() if run.incline_deg == incline)


def test_on_level_ground_each_rod_adds_a_square_of_its_diameter():
    heights = heap_heights(CHAIN, SURFACE, 0.0)
    diameter = CHAIN.diameters[0]
    assert heights == pytest.approx([diameter * math.sqrt(k) for k in range(25)])


@pytest.mark.parametrize("incline", [35.0, 40.0, 60.0, 80.0])
def test_like_rods_on_a_steep_board_are_gone_before_the_next_comes(incline):
    run = replace(RUNS[at(40.0)], incline_deg=incline)
    assert not heap_heights(CHAIN, SURFACE, incline).any()
    assert on_heap(UNIFORM, run) is None


def test_rods_stay_where_friction_stops_them():
    """μ (1 + β) = tan θ leaves no speed down the board: the heap is that of level ground."""
    incline = 25.0
    held = Quantity(math.tan(math.radians(incline)) / 1.5, 0.0)
    surface = Surface(Quantity(0.5, 0.0), held)
    assert heap_heights(CHAIN, surface, incline) == pytest.approx(heap_heights(CHAIN, SURFACE, 0.0))


def test_thick_rods_touch_a_board_before_thin_ones():
    chain = GRADED.chains["A"]
    heights = np.array(strike_heights(GRADED.surface, 60.0, chain))
    sine, cosine = math.sin(math.radians(21.0)), math.cos(math.radians(60.0))
    across = math.sqrt(1.0 - (sine * cosine) ** 2) / cosine
    radii = 0.5 * np.array(chain.diameters)
    assert heights == pytest.approx((radii - radii[-1]) * across)


def test_the_top_rod_strikes_on_the_heap_as_surely_as_it_is_known():
    run = RUNS[at(0.0)]
    heaped = on_heap(UNIFORM, run)
    top = CHAIN.diameters[0] * math.sqrt(24)
    assert heaped.contact.strike.value == pytest.approx(top)
    assert heaped.contact.strike.u == pytest.approx(math.hypot(10e-3, top / 3.0))


def test_where_nothing_is_struck_or_rods_have_no_thickness_nothing_lies():
    bare = replace(CHAIN, diameters=())
    run = RUNS[at(0.0)]
    assert on_heap(replace(UNIFORM, surface=None), run) is None
    assert on_heap(replace(UNIFORM, chains={"A": bare, "B": bare}), run) is None
    assert on_heap(SINGLE, replace(run, impact=None)) is None


@pytest.fixture(scope="module")
def piled():
    """Drops of the resolved world, and what is true of them."""
    numbers = [at(0.0), at(10.0), at(20.0)]
    url = f"sim://?dynamics=resolved&stated=1&protocol={PROTOCOLS / 'inclined-uniform.yaml'}"
    return [*falls([Asked(url, [SEED], [numbers])])]


def test_drops_on_a_pile_are_marginal_with_results_at_strike(piled):
    for fall in piled:
        result, _ = fit_drop(UNIFORM, RUNS[fall.drop.run], fall.drop, time_scale(SEED))
        assert result.verdict == "marginal", fall.drop.run
        (reason,) = (reason for reason in result.reasons if reason.code == "rods_lie")
        height, truth = reason.values["height_m"], fall.truth
        assert abs(height - truth["contact_height_m"]) < reason.values["U95_m"]
        assert not {"gate_disagrees", "gate_off", "gate_height"} & set(codes(result))
        assert fall.rods(result.matches)[0] == 0
        for name in ("separation_strike_m", "speed_strike_m_s", "release_skew_s"):
            measured = result.quantities[name]
            assert abs(measured.value - truth[name]) < 1.5 * measured.expanded, name


def test_what_was_found_of_a_heap_is_kept_for_the_next_time(piled):
    fall = piled[0]
    one = DropCase(UNIFORM, RUNS[fall.drop.run], fall.drop, time_scale(SEED))
    first = one.summary()
    assert first.passages == Passages(heaped=True)
    assert first.identified.keys() == {Passages(), Passages(heaped=True)}
    again = one.summary(first)
    assert again.result.quantities == first.result.quantities
    assert json.dumps(again.result.json()) == json.dumps(first.result.json())
    assert one.fit(first).rods == first.result.matches


def test_a_beam_that_sees_no_end_of_the_fall_is_not_to_blame(piled):
    gates = UNIFORM.gates
    low = tuple(gate for gate in gates.gates if gate.side == "free" or gate.height < 0.03)
    scene = replace(UNIFORM, gates=replace(gates, gates=low))
    fall = piled[0]
    channels = {gate.channel for gate in low}
    edges = tuple(edge for edge in fall.drop.edges if edge.channel in channels)
    drop = replace(fall.drop, edges=edges)
    result, _ = fit_drop(scene, RUNS[drop.run], drop, time_scale(SEED), explain=False)
    assert (result.verdict, codes(result)) == ("void", ["rods_hide_end"])
