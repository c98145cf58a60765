"""Later passages of what fell: a ball that bounces, a glider that comes back up its track.

It rises through a gate and falls through it again, with at most the energy with which it first
passed at speed v. So each shadow lasts at least width/v, and the second of a pair follows the first
within the flight 2v/g. Neither holds for a pendulum, whose half period is longer than that, nor for
edges of lower gates on the same channel. The last shadow may stand alone: of a turn in the beam, or
because the recording ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord, EdgeTrain
    from rig.analysis.trajectory import Trajectory

    Index = NDArray[np.intp]

_WIDTH = 0.2
"""Share by which a beam may see an object wider or narrower than stated: one that passes half its
radius off the middle of a beam has a chord that is 13 % shorter."""


def later_passages(
    record: ChainRecord, train: EdgeTrain, match: Index, path: Trajectory, gravity: float
) -> set[int]:
    """Find the edges of what came back after it had passed a gate, and perhaps fell once more.

    Parameters
    ----------
    record, train, match
        The chain, one of its gates, and which of its edges is which expected one (-1: none).
    path
        The chain's motion.
    gravity
        Acceleration of a free fall, or down the track, m/s².

    Returns
    -------
    set of int
        Numbers of the edges in the train; empty for a chain, whose rods too many would look alike.
    """
    if record.ratios is not None or record.chain.chain.rods > 1 or not (match >= 0).any():
        return set()
    later = np.arange(int(match.max()) + 1, train.times.size)
    if not train.blocked.all():
        # Each shadow begins as the beam darkens and ends with the very next edge.
        begins = later[:-1][train.blocked[later[:-1]] & ~train.blocked[later[1:]]]
        ends = begins + 1
    else:  # a timer that tells no ends of shadows
        begins = ends = later
    speed = float(path.heights(train.times[match.max()])[1])
    lasting = train.times[ends] - train.times[begins]
    slow = (begins == ends) | (lasting * speed * (1.0 + _WIDTH) >= min(record.chain.widths))
    begins, ends = begins[slow], ends[slow]
    flight = 2.0 * speed * (1.0 + _WIDTH) / gravity
    found: set[int] = set()
    at = 0
    while at < begins.size:
        pair = at + 1 < begins.size and train.times[begins[at + 1]] - train.times[ends[at]] < flight
        if pair or at + 1 == begins.size:
            for shadow in range(at, at + 1 + pair):
                found |= {int(begins[shadow]), int(ends[shadow])}
        at += 1 + pair
    return found
