"""Annealing finds the fall in real records and none elsewhere; what begins is near."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.annealing import LEAST, RELEASE, UNKNOWNS, SideFall
from rig.analysis.drop_model import DropModel
from rig.model.impact import impact_on
from rig.protocol.protocol import Protocol
from rig.records import Edge
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import CLOCK_U, FENCE, HZ, SCENES, STATED, UNIFORM, Case, case, codes
from tests.examples import examples

RECORD = case(UNIFORM, Dials.quiet(), incline=40.0)


@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.8])
def test_alpha_is_found_far_from_what_the_model_expects(restitution):
    one = case(UNIFORM, replace(Dials.quiet(), restitution=restitution), incline=40.0)
    surface = replace(UNIFORM.surface, restitution=Quantity(restitution))
    true = impact_on(surface, UNIFORM.chains["A"].chain, 40.0).alpha
    assert one.guesses()["impact"].alpha == pytest.approx(true, abs=2e-3)


def falls_of(one: Case, protocol: Protocol | None = None) -> list[SideFall]:
    """What annealing knows of each side."""
    protocol = protocol or one.protocol
    model = DropModel.of(protocol, one.records, None, CLOCK_U, STATED)
    return [model.side(role) for role in model.records]


@pytest.mark.parametrize("scene", SCENES)
def test_derivatives_are_those_of_the_heights(scene):
    """Of every unknown, at falls that differ, beside differences of twice the size."""
    rng = np.random.default_rng(3)
    for fall in falls_of(case(SCENES[scene], Dials.quiet())):
        falls = 0.3 * rng.uniform(0.1, 1.0, (4, UNKNOWNS)) * (fall.sd > 0.0)
        falls[:, RELEASE] = 0.02
        slopes = fall.sights(falls)[2]
        for name in np.flatnonzero(fall.sd > 0.0):
            step = np.zeros(UNKNOWNS)
            step[name] = 2e-5 if name == RELEASE else 1e-3
            up, down = (fall.sights(falls + sign * step)[0] for sign in (1, -1))
            assert np.median(np.abs((up - down) / (2.0 * step[name]) - slopes[..., name])) < (
                1e-5 * np.abs(slopes[..., name]).max() + 1e-9
            )


def test_no_falls_come_by_at_no_times():
    """As where all that a suspected fault leaves possible is outside of α's domain."""
    for fall in falls_of(RECORD):
        times = fall.path(np.zeros((0, UNKNOWNS))).times(fall.levels)
        assert times.shape == (0, fall.levels.size)


@pytest.mark.parametrize("late", [1.0, 1800.0])
def test_a_record_may_begin_long_before_the_fall_and_end_long_after_it(late):
    """Also of half an hour, with edges at either end of it."""
    ends = [Edge(0, 0, True), Edge(round(2 * late * HZ), 0, False)]
    moved = [edge._replace(tick=edge.tick + round(late * HZ)) for edge in RECORD.drop.edges]
    result = RECORD.with_edges([*ends, *moved]).analyze()
    assert result.audit.missed == 0
    assert result.audit.matched == len(moved)


def pile(scene: Case, count: int, seed: int) -> Case:
    """As many edges anywhere, each gate's polarities alternating as on a wire."""
    rng = np.random.default_rng(seed)
    channels = [gate.channel for gate in scene.protocol.gates.gates]
    level = dict.fromkeys(channels, False)
    edges = []
    for tick in np.sort(rng.integers(0, int(0.8 * HZ), count)).tolist():
        channel = int(rng.choice(channels))
        level[channel] = not level[channel]
        edges.append(Edge(tick, channel, level[channel]))
    return scene.with_edges(edges)


@pytest.mark.parametrize(("share", "seed"), [(0.5, 0), (1.0, 1)])
def test_a_pile_of_edges_looks_like_no_chain(share, seed):
    one = pile(RECORD, round(share * len(RECORD.drop.edges)), seed)
    assert max(one.identify().shares.values()) < LEAST - 0.2
    result = one.judge()
    assert result.verdict == "void"
    assert set(codes(result)) & {"few_edges_fit", "no_fall"}


@examples(10)
@given(
    st.sampled_from([RECORD, case(FENCE, Dials.quiet())]),
    st.lists(st.tuples(st.integers(-HZ, 3 * HZ), st.integers(0, 15), st.booleans()), max_size=25),
)
def test_any_few_edges_give_a_verdict(scene, edges):
    result = scene.with_edges([Edge(*edge) for edge in edges]).analyze()
    # So few cannot be the 32 of the fence less the 15 % that may be missed.
    assert result.verdict == "void"
    assert result.reasons
    assert result.audit.received <= len(edges)
