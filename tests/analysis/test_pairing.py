"""Matching edges to rods: by weights of all rods, and right on edges whose rods are known."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from rig.analysis.annealing import Pairing
from rig.analysis.chain_records import ChainRecord
from rig.analysis.trajectory import free_trajectory
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case


def align(trains, levels, trajectory, scale, clock=0.0, widths=()):
    """Match all trains of a side at once."""
    every = np.concatenate([*levels, np.zeros(0)])
    pairing = Pairing.of(trains, widths)
    heights, speeds = trajectory.heights(pairing.times * (1.0 + clock))
    return pairing.matched(every, heights, speeds, scale)


GRAVITY = 9.81
START = 0.5


SCALE = 1e-3

# An edge: where the chain is when it comes, in units of SCALE, and its polarity.
edges = st.lists(st.tuples(st.floats(-12, 12), st.booleans()), max_size=4)
# Rods of one polarity are further apart than an edge may be off.
places = st.integers(-3, 3).map(lambda n: 4.0 * n)
rods = st.lists(st.tuples(places, st.booleans()), max_size=5, unique=True)


def at(height: float) -> float:
    return float(np.sqrt(2 * (START - height) / GRAVITY))


QUIET = case(UNIFORM, Dials.quiet(), incline=40.0)
FALL = free_trajectory(0.020, 0.180, GRAVITY)  # the free side, exactly


def matched(side: ChainRecord) -> list:
    return align(side.trains, [train.levels for train in side.trains], FALL, 0.5e-3)


def test_no_end_of_another_shadow_is_taken_for_the_top_rods():
    """A rod thrown back and the top rod make one shadow, and it ends about when the top rod would.

    Of a rod amid the chain its neighbours tell.
    """
    side = QUIET.side("free")
    widths = side.chain.widths
    for rod in (12, 24):
        (train, *_) = side.trains
        begin = int(np.flatnonzero((train.rods == rod) & train.blocks)[0])
        times = train.times.copy()
        times[begin] -= 2.5 * (times[begin + 1] - times[begin])  # so much earlier it darkens
        (match,) = align([replace(train, times=times)], [train.levels], FALL, 0.5e-3, widths=widths)
        assert match[begin] == -1
        assert (match[begin + 1] == -1) == (rod == 24)
        assert (np.delete(match, [begin, begin + 1]) >= 0).all()
