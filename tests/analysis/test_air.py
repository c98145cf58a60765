"""Rods of unlike thickness: in air, beside the closed form of a fall, and where they strike."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from bench.studies.falls import Asked, falls
from bench.studies.layout_catalogue import Kind, graded, under
from bench.studies.time_scales import time_scale
from rig.analysis.chain_records import chain_records
from rig.analysis.departures import lags, strike_u
from rig.analysis.drop import DropCase
from rig.analysis.drop_model import DropModel
from rig.analysis.dual import Dual
from rig.analysis.gravity import free_gravity
from rig.analysis.quantities import AdjustedDrop
from rig.protocol.protocol import Contact
from rig.protocol.reader import parse, read
from rig.units import Quantity
from tests.analysis.drops import PROTOCOLS, SCENES, assert_true, case
from tests.analysis.sessions import MILD, analysis

THICK_TOP = "[{count: 18, diameter: 10 mm}, {count: 2, diameter: 25 mm}]"


def record_of(scene, role, incline=None):
    one = case(SCENES[scene], MILD, incline=incline)
    impact, *free = chain_records(one.protocol, one.run, one.drop, one.scale.hz)
    return impact if role == "impact" else free[0]


def test_a_rod_left_alone_lags_as_its_own_fall_does():
    protocol = SCENES["graded"]
    record = record_of("graded", "free")
    drop, gravity, kappa, time = protocol.drop.value, protocol.gravity.value, 1e-4, 0.4

    def fallen(drag):  # v' = g − κv²
        return math.log(math.cosh(math.sqrt(gravity * drag) * time)) / drag

    way = 0.5 * gravity * time**2
    rods = np.arange(record.chain.chain.rods)
    found = kappa * lags(record, drop, rods, np.full(rods.size, drop - way))
    expected = [fallen(kappa) - fallen(kappa * (1.0 + more)) for more in record.unlike]
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_a_rod_strikes_lower_the_further_a_swing_carries_it():
    protocol = replace(SCENES["uniform"], contact=Contact(strike=Quantity(0.0)))
    record = record_of("uniform", "impact", 60.0)
    lower = strike_u(record, protocol)
    lasted = math.sqrt(2.0 * protocol.drop.value / protocol.gravity.value)
    carried = protocol.priors.swing * lasted
    assert lower[0] == pytest.approx(math.tan(math.radians(60.0)) * carried)
    assert lower[-1] == 0.0
    assert not strike_u(replace(record, incline_deg=0.0), protocol).any()
    # Along a vertical board no rod strikes lower than it fell; one that touches it fell no way.
    thick = replace(record, incline_deg=90.0, higher=(0.2,) * record.chain.chain.rods)
    lower = strike_u(thick, protocol)
    assert lower[0] == 0.0
    assert lower[-2] == pytest.approx(protocol.drop.value + thick.strikes[-2])


def test_a_chain_of_another_wood_needs_not_fall_as_its_width_says():
    """Thick rods that weigh as much more: air takes as much of both chains, and nobody weighed."""
    chains = SCENES["uniform"].chains
    thick = replace(
        chains["B"],
        diameters=tuple(2.0 * d for d in chains["B"].diameters),
        widths=tuple(2.0 * width for width in chains["B"].widths),
    )
    stated = replace(SCENES["uniform"], chains={"A": chains["A"], "B": thick})
    heavy = replace(
        thick, weighed=True, chain=replace(thick.chain, masses=(2.0,) * thick.chain.rods)
    )
    true = replace(stated, chains={"A": replace(chains["A"], weighed=True), "B": heavy})
    drops = [case(true, replace(MILD, drag=0.02), seed=3, run=run) for run in (1, 2, 3, 4)]
    found = analysis(drops, stated)
    for one, result in zip(drops, found.runs, strict=True):
        assert result.learned
        assert_true(result, one.truth, 2.0)


@pytest.mark.parametrize("block", ["impact air lag", "impact slack", "stretch"])
def test_a_chain_arrives_when_its_top_rod_does(block):
    """By what it is off its place in the chain, too."""
    records = [record_of("graded", role) for role in ("impact", "free")]
    model = DropModel.of(SCENES["graded"], records, 0.0)
    x, level = np.zeros(len(model.unknowns)), -model.records["impact"].strikes[-1:]
    x[model.unknowns["alpha"]] = model.alpha
    x[model.unknowns[block]] = 1e-3
    drop = AdjustedDrop(model, x)
    hit = drop.arrival.when
    moment = Dual(np.array([hit.value]), hit.slopes[None])
    off = abs(drop.ahead("impact", level).value[0])
    assert off > 0.5e-3
    assert abs(drop.top("impact", drop.levels("impact", moment))[0].value) < 0.01 * off


@pytest.mark.usefixtures("loops_compiled")
def test_gravity_by_a_graded_chain_is_right_where_air_makes_its_strings_taut():
    """In the resolved world, whose rods hang tilted: no equation of the analysis is in it."""
    ready, seeds = PROTOCOLS / "graded-chain.yaml", [1]
    url = f"sim://?dynamics=resolved&drag=0.025&protocol={ready}"
    graded, off = SCENES["graded"], []
    runs = {run.number: run for run in graded.runs()}
    for fall in falls([Asked(url, seeds, [[1]] * len(seeds))]):
        _, fit = DropCase(graded, runs[1], fall.drop, time_scale(fall.seed)).read()
        gravity = free_gravity(fit)
        off.append((gravity.value - graded.gravity.value) / gravity.u)
    assert np.sqrt(np.mean(np.square(off))) < 1.5, off


@pytest.mark.usefixtures("loops_compiled")
def test_the_skew_holds_where_each_rod_below_lags_alone(tmp_path):
    """In the resolved world: no string holds a thin rod that falls behind the thick ones above."""
    path, off = tmp_path / "thin-below.yaml", []
    shares = (0.15, 0.3, 0.5, 0.75), (0.18, 0.35, 0.55, 0.75)
    path.write_text(under(Kind("", graded((6, 9, 14, 20, 28), 1200)), *shares).protocol())
    protocol, url = read(path), f"sim://?dynamics=resolved&drag=0.03&protocol={path}"
    run = next(run for run in protocol.runs() if run.incline_deg == 40.0)
    for fall in falls([Asked(url, [1, 2, 3], [[run.number]] * 3)]):
        result, _ = DropCase(protocol, run, fall.drop, time_scale(fall.seed)).read()
        skew = result.quantities["release_skew_s"]
        off.append((skew.value - fall.truth["release_skew_s"]) / skew.u)
    assert np.abs(off).max() < 2.0, off


def test_a_top_rod_strikes_as_high_as_rods_are_thick_unless_stated():
    protocol, record = SCENES["uniform"], record_of("uniform", "impact", 0.0)
    thickness, usual = record.chain.diameters[0], protocol.contact.strike.u
    assert strike_u(record, protocol)[-1] == pytest.approx(max(usual, thickness))
    stated = strike_u(record, replace(protocol, contact=Contact(strike=Quantity(0.0, 2e-3))))
    assert stated[-1] == 2e-3
    assert stated[-2] == pytest.approx(thickness)


@pytest.mark.parametrize("late_s", [2e-4, 5e-4])
def test_an_edge_after_the_strike_moves_no_edge_before(late_s):
    """Thick rods at the top: the last edge of the lowest beam is the top rod's own affair."""
    text = (PROTOCOLS / "graded-chain.yaml").read_text("utf-8")
    text = re.sub(r"rods:\n(      - .*\n)+", f"rods: {THICK_TOP}\n", text)
    for hidden, free in {217: 220, 365: 400, 695: 640, 1078: 1090}.items():
        text = text.replace(f"height: {hidden} mm", f"height: {free} mm")
    one = case(parse(text), MILD)
    before = one.analyze().quantities
    lowest, *_ = (gate.channel for gate in one.protocol.gates.gates if gate.side == "impact")
    edges = [*one.drop.edges]
    last = max(n for n, edge in enumerate(edges) if edge.channel == lowest)
    edges[last] = edges[last]._replace(tick=edges[last].tick + round(late_s * one.drop.tick_hz))
    after = one.with_edges(edges).analyze().quantities
    for name in ("separation_raw_m", "speed_m_s", "fall_time_s"):
        moved = abs(after[name].value - before[name].value)
        assert moved < 0.2 * before[name].expanded
