"""Gravity from the free chain as a check of clock and beam heights.

This is not a result. In g = 2·length/time² an error of the time scale counts twice. A g that
differs from the local value means that the clock, a beam's height or the protocol's gravity is
wrong. Only the free chain's edges are used, like those of a calibration drop. Drag is a further
unknown: without it, a light chain would give a g several per cent too low.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rig.analysis.annealing import count_matched
from rig.analysis.averages import mean
from rig.analysis.chain_records import SIDES
from rig.analysis.evidence import STATED_WEIGHT
from rig.analysis.fit import Fit
from rig.analysis.result import DropResult, Measured, good_runs
from rig.analysis.square_root import square_root
from rig.analysis.unknowns import ANY_GRAVITY
from rig.measurands import GRAVITY
from rig.plain_data import Record
from rig.protocol.protocol import Protocol
from rig.reasons import Reason, make_reason
from rig.units import Quantity


@dataclass(frozen=True, slots=True)
class GravityCheck(Record):
    """Gravity from the free chain, compared with the protocol's.

    Attributes
    ----------
    measured
        Mean over drops, m/s².
    stated
        Value of the protocol, m/s².
    drops
        Number of drops.
    """

    MEMBERS = "gravity_m_s2=measured stated_m_s2=stated.value drops normalized_error agrees"

    measured: Measured
    stated: Quantity
    drops: int

    @property
    def normalized_error(self) -> float:
        """E_n of the measured against the stated value."""
        stated = Measured(self.stated.value, self.stated.u)
        return self.measured.less(stated).normalized_error or 0.0

    @property
    def agrees(self) -> bool:
        """Whether both values agree, |E_n| ≤ 1."""
        return abs(self.normalized_error) <= 1.0

    @property
    def doubts(self) -> tuple[Reason, ...]:
        """Reason for a disagreement; empty if both values agree."""
        if self.agrees:
            return ()
        values = {"g": self.measured.value, "U": self.measured.expanded}
        error, stated = self.normalized_error, self.stated.value
        return (make_reason("gravity_unlike", stated=stated, E_n=error, **values),)


def check_gravity(protocol: Protocol, results: Iterable[DropResult]) -> GravityCheck | None:
    """Compare the free chain's fall with the protocol's gravity.

    Parameters
    ----------
    results
        Results of drops; void and rejected drops do not count.

    Returns
    -------
    GravityCheck or None
        `None` if no free chain passes gates.
    """
    values = [run.quantities.get(GRAVITY.name, run.gravity) for run in good_runs(results)]
    measured = [value for value in values if value is not None]
    return GravityCheck(mean(measured), protocol.gravity, len(measured)) if measured else None


def free_gravity(fit: Fit) -> Measured | None:
    """Return gravity from the free chain's edges alone, with all other unknowns at their priors.

    A single Gauss–Newton step from the fit of the whole drop suffices.

    Returns
    -------
    Measured or None
        m/s²; `None` if no free chain passes beams, or gravity is the measurand.
    """
    estimate, model, rows = fit.estimate, fit.model, fit.estimate.rows.get("free")
    if rows is None or model.protocol.surface is None:
        return None
    edges, free = count_matched(fit.matches["free"]), rows.columns
    if edges < SIDES:
        return None
    at = int(np.flatnonzero(free == model.unknowns["gravity"].start)[0])
    x, sd, pull = estimate.x[free], estimate.sd[free], model.unknowns.pull(estimate.x)[free]
    sd[at], pull[at], share = ANY_GRAVITY, x[at] / ANY_GRAVITY, 1.0
    rows = rows._replace(columns=np.arange(free.size)).triangle()
    for _ in range(2):
        # Estimate the scatter from the residuals; the stated scatter counts as `STATED_WEIGHT`.
        rows = rows._replace(slopes=rows.slopes / share, left=rows.left / share)
        root = square_root([rows], sd, pull)
        step, inverse = root.step(), np.linalg.inv(root.matrix)
        residuals = rows.after(step * sd).left
        degrees = max(0.0, edges - sd.size + float(np.sum(inverse**2)))
        share = math.sqrt(
            (STATED_WEIGHT + float(residuals @ residuals)) / (STATED_WEIGHT + degrees)
        )
    value = model.protocol.gravity.value + float(x[at] + step[at] * sd[at])
    u = float(np.linalg.norm(inverse[at]) * sd[at])
    # Errors of beams, rods and clock are the same in every drop: averaging does not reduce them.
    return Measured(value, u, budget={"beam heights": u})
