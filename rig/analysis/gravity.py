"""Gravity from the free chain, as a check of the clock: its rods fall past beams of known height.

This is no result. In g = 2·length/time² an error of the time scale counts twice, so a g that is not
the place's says that the clock, a beam's height or the protocol's gravity is not what it is said
to be. The free chain's edges are asked alone, as those of the calibration drop that it is. What the
air takes is unknown beside it: a light chain would read several per cent less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.averages import average
from rig.analysis.equations import scaled
from rig.analysis.evidence import STATED_WEIGHT
from rig.analysis.fit import count_matched
from rig.analysis.plain_data import attributes
from rig.analysis.result import GOOD, Measured
from rig.analysis.square_root import square_root
from rig.analysis.unknowns import ANY_GRAVITY
from rig.reasons import make_reason

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rig.analysis.fit import Fit
    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Protocol
    from rig.reasons import Reason
    from rig.units import Quantity

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

    @property
    def doubts(self) -> tuple[Reason, ...]:
        """Where they do not, that something is not as stated."""
        if self.agrees:
            return ()
        found = {
            "g": self.measured.value,
            "U": self.measured.expanded,
            "E_n": self.normalized_error,
        }
        return (make_reason("gravity_unlike", stated=self.stated.value, **found),)

    def json(self) -> dict[str, Any]:
        """A member of ``calibration``."""
        fields = {"gravity_m_s2": self.measured.json(), "stated_m_s2": self.stated.value}
        return fields | attributes(self, "drops", "normalized_error", "agrees")


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
    candidates = [
        result.quantities.get("gravity_m_s2", result.gravity)
        for result in results
        if result.verdict in GOOD
    ]
    gravities = [gravity for gravity in candidates if gravity is not None]
    if not gravities:
        return None
    # Beams, rods and clock are the same in every drop, so that no number of drops averages them.
    common = math.sqrt(fmean(measured.u**2 for measured in gravities))
    values, n = [measured.value for measured in gravities], len(gravities)
    seen = stdev(values) / math.sqrt(n) if n > 1 else 0.0
    mean = average(fmean(values), 0.0, seen, n - 1.0, common, gravities)
    return GravityCheck(mean, protocol.gravity, len(gravities))


def free_gravity(fit: Fit) -> Measured | None:
    """Let the free chain's edges alone say what gravity is, with all else as uncertain as it is.

    About the fit of the whole drop one step leads there.

    Returns
    -------
    Measured or None
        m/s²; `None` where no free chain falls past beams, or gravity is what a scene measures.
    """
    estimate, model, rows = fit.estimate, fit.model, fit.estimate.rows.get("free")
    if rows is None or model.protocol.surface is None:
        return None
    edges, at = count_matched(fit.matches["free"]), model.unknowns["gravity"].start
    if edges < _FEWEST:
        return None
    sd = estimate.sd.copy()
    sd[at] = ANY_GRAVITY
    pull, share = scaled(estimate.x, sd), 1.0
    for _ in range(2):
        # How much edges scatter is seen where they are many; what is stated counts as one more.
        rows = rows._replace(slopes=rows.slopes / share, left=rows.left / share)
        root = square_root([rows], sd, pull)
        step, inverse = root.step(), np.linalg.inv(root.matrix)
        residuals = rows.after(step * sd).left
        degrees = max(0.0, edges - sd.size + float(np.sum(inverse**2)))
        share = math.sqrt(
            (STATED_WEIGHT + float(residuals @ residuals)) / (STATED_WEIGHT + degrees)
        )
    value = model.protocol.gravity.value + float(estimate.x[at] + step[at] * sd[at])
    return Measured(value, float(np.linalg.norm(inverse[at]) * sd[at]))
