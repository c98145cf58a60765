"""Gravity from the free chain, as a check of the clock: its rods fall past beams of known height.

This is no result. In g = 2·length/time² an error of the time scale counts twice, so a g that is not
the place's says that the clock, a beam's height or the protocol's gravity is not what it is said
to be. It takes the adjustment's matches of edges to rods, and fits the free chain by itself, as
the calibration drop that it is. What the air takes is fitted beside it: a light chain would read
several per cent less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.adjust import adjust
from rig.analysis.annealing import Guess
from rig.analysis.averages import average
from rig.analysis.chain_records import chain_records
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import Expected
from rig.analysis.evidence import STATED_WEIGHT
from rig.analysis.fit import CLOSE
from rig.analysis.plain_data import attributes
from rig.analysis.quantities import Adjusted
from rig.analysis.result import GOOD, Measured
from rig.analysis.trajectory import free_trajectory
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from rig.analysis.chain_records import EdgeTrain
    from rig.analysis.result import DropResult
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.units import Quantity

    Index = NDArray[np.intp]

_FEWEST = 8  # edges


@dataclass(frozen=True, slots=True)
class GravityCheck:
    """Gravity as the free chain falls and as the protocol says.

    Attributes
    ----------
    measured
        Mean over drops, m/s².
    stated
        The protocol's, m/s².
    drops
        How many.
    """

    measured: Measured
    stated: Quantity
    drops: int

    @property
    def normalized_error(self) -> float:
        """Of what is measured against what is stated."""
        stated = Measured(self.stated.value, self.stated.u)
        return self.measured.less(stated).normalized_error or 0.0

    @property
    def agrees(self) -> bool:
        """Whether they do."""
        return abs(self.normalized_error) <= 1.0

    def json(self) -> dict[str, Any]:
        """A member of ``calibration``."""
        said = {"gravity_m_s2": self.measured.json(), "stated_m_s2": self.stated.value}
        return said | attributes(self, "drops", "normalized_error", "agrees")


def check_gravity(protocol: Protocol, results: Iterable[DropResult]) -> GravityCheck | None:
    """Compare the free chain's fall with the protocol's gravity.

    Parameters
    ----------
    results
        Of drops; those that are void or rejected do not count.

    Returns
    -------
    GravityCheck or None
        `None` where no free chain passes gates.
    """
    # Without a surface it is what is measured, and a joint fit knows it better.
    every = [
        result.quantities.get("gravity_m_s2", result.gravity)
        for result in results
        if result.verdict in GOOD
    ]
    found = [gravity for gravity in every if gravity is not None]
    if not found:
        return None
    # Beams, rods and clock are the same in every drop, so that no number of drops averages them.
    common = math.sqrt(fmean(one.u**2 for one in found))
    values, n = [one.value for one in found], len(found)
    seen = stdev(values) / math.sqrt(n) if n > 1 else 0.0
    mean = average(fmean(values), 0.0, seen, n - 1.0, common, found)
    return GravityCheck(mean, protocol.gravity, len(found))


@one_thread
def free_gravity(
    protocol: Protocol, result: DropResult, drop: Drop, scale: TimeScale
) -> Measured | None:
    """Fit the free chain's fall to one drop's matched edges, as in a scene without a surface."""
    if protocol.gates is None or result.run.free is None:
        return None
    if protocol.surface is None:  # then this is what is measured
        return result.quantities.get("gravity_m_s2")
    scene = replace(protocol, surface=None)
    (record,) = chain_records(scene, replace(result.run, impact=None), drop, scale.hz) or (None,)
    if record is None:
        return None
    matches = [_matched(train, result.matches) for train in record.trains]
    expected = Expected.of(record, scene)
    pick, edge = expected.chosen(matches)
    if pick.size < _FEWEST:
        return None
    fall = free_trajectory(0.0, scene.drop.value, scene.gravity.value)
    release = float(np.median(expected.times[edge] - fall.times(expected.levels[pick])))
    guesses = {"free": Guess(release, scene.drop.value)}
    model = DropModel(scene, [record], guesses, scale.u)
    estimate = adjust(model, {"free": matches}, model.first(), done=CLOSE)
    # How much edges scatter is seen where they are many; what is stated of it counts as one more.
    if estimate.scatter == 1.0:
        scatter = (STATED_WEIGHT + estimate.chi2) / (STATED_WEIGHT + estimate.degrees)
        sizes, share = model.components, math.sqrt(scatter)
        model.components = replace(sizes, floor=sizes.floor * share, jitter=sizes.jitter * share)
        estimate = adjust(model, {"free": matches}, estimate.x, done=CLOSE)
    gravity = Adjusted(model, estimate.x).gravity
    return Measured(float(gravity.value), estimate.u(gravity.slopes))


def _matched(train: EdgeTrain, rods: Mapping[int, int]) -> Index:
    """Return which edge of a train each expected one is, −1 for none; `rods` of a drop's edges."""
    passages = zip(train.rods.tolist(), train.blocks.tolist(), strict=True)
    seen = {
        (rods.get(number), blocked): at
        for at, (number, blocked) in enumerate(
            zip(train.edge.tolist(), train.blocked.tolist(), strict=True)
        )
    }
    return np.array([seen.get(passage, -1) for passage in passages], dtype=np.intp)
