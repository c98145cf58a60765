"""Matching edges to rods: no edge of another shadow is taken for a rod's."""

from dataclasses import replace

import numpy as np

from rig.analysis.annealing import Pairing
from rig.analysis.trajectory import free_trajectory
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case

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
        (match,) = pairing.match(train.levels, *FALL.heights(pairing.times), 0.5e-3)
        assert match[begin] == -1
        assert (match[begin + 1] == -1) == (rod == 24)
        assert (np.delete(match, [begin, begin + 1]) >= 0).all()
