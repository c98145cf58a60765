"""Annealing finds the fall in real records, however far it is from what is expected."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.annealing import UNKNOWNS, Pairing
from rig.analysis.drop_model import DropModel
from rig.analysis.trajectory import free_trajectory
from rig.model.impact import impact_on
from rig.records import Edge
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import HZ, UNIFORM, case

RECORD = case(UNIFORM, Dials.quiet(), incline=40.0)


@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.8])
def test_alpha_is_found_far_from_what_the_model_expects(restitution):
    one = case(UNIFORM, replace(Dials.quiet(), restitution=restitution), incline=40.0)
    surface = replace(UNIFORM.surface, restitution=Quantity(restitution))
    true = impact_on(surface, UNIFORM.chains["A"].chain, 40.0).alpha
    model, _, x = one.model()
    assert model.alphas(x) == pytest.approx(true, abs=2e-3)


@pytest.mark.parametrize("late", [1.0, 1800.0])
def test_a_record_may_begin_long_before_the_fall_and_end_long_after_it(late):
    """Also of half an hour, with edges at either end of it."""
    ends = [Edge(0, 0, True), Edge(round(2 * late * HZ), 0, False)]
    moved = [edge._replace(tick=edge.tick + round(late * HZ)) for edge in RECORD.drop.edges]
    result = RECORD.with_edges([*ends, *moved]).analyze()
    assert result.audit.missed == 0
    assert result.audit.matched == len(moved)


def test_no_falls_come_by_at_no_times():
    """As where all that a suspected fault leaves possible is outside of α's domain."""
    model = DropModel.of(UNIFORM, RECORD.records, 0.0)
    side = model.side("impact")
    times = side.path(np.zeros((0, UNKNOWNS))).times(side.levels)
    assert times.shape == (0, side.levels.size)


FALL = free_trajectory(0.020, 0.180, 9.81)  # the free side of a quiet drop, exactly


def test_no_end_of_another_shadow_is_taken_for_the_top_rods():
    """A rod thrown back and the top rod make one shadow, and it ends about when the top rod would.

    Of a rod amid the chain its neighbours tell.
    """
    side = case(UNIFORM, Dials.quiet(), incline=40.0).side("free")
    for rod in (12, 24):
        (train, *_) = side.trains
        begin = int(np.flatnonzero((train.rods == rod) & train.blocks)[0])
        times = train.times.copy()
        times[begin] -= 2.5 * (times[begin + 1] - times[begin])  # so much earlier it darkens
        pairing = Pairing.of([replace(train, times=times)], side.chain.widths)
        match = pairing.match(train.levels, *FALL.heights(pairing.times), 0.5e-3)
        assert match[begin] == -1
        assert (match[begin + 1] == -1) == (rod == 24)
        assert (np.delete(match, [begin, begin + 1]) >= 0).all()
