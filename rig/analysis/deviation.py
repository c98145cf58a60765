"""How far a drop's result may be from a prediction that holds.

Unknowns x are counted in units of their prior uncertainties, and w = M⁻¹g for a result with the
gradient g, M being the normal matrix with its prior. The true value moves by g·x and the result's
error is −w·x, and what the edges' scatter adds: the variance of result less prediction is therefore
g·g − g·w for what has a prior. Of what the edges alone tell, such as α, the prediction knows the
value: it has no share in g·g, and leaves 2 e·w with e its part of g.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.distributions import COVERAGE_95, coverage_factor
from rig.analysis.result import Deviation
from rig.analysis.unknowns import Side
from rig.protocol.protocol import GUESSED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.analysis.adjust import Estimate
    from rig.analysis.drop_model import DropModel
    from rig.analysis.joint_fit import JointDrop, JointFit

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]


_GUESSED = frozenset({"side", "contact"})
"""Lines of the budget of a guessed size that no number of drops tells."""


class Supposed(NamedTuple):
    """What a prediction supposes of a drop's unknowns.

    Attributes
    ----------
    known
        Which ones only the edges tell and the prediction knows, shape ``(unknowns,)``.
    absent
        Share of the prior variance of each that is none where the prediction's equations hold: what
        strings do besides, and air of which the protocol says nothing.
    """

    known: Flags
    absent: Array


def supposed(model: DropModel) -> Supposed:
    """Say what the prediction supposes of a drop."""
    at = model.unknowns
    known, absent = np.zeros(len(at), dtype=np.bool_), np.zeros(len(at))
    measured = "alpha" if "impact" in model.records else "gravity"
    for name, row in at.rows.items():
        known[at[name]] = row.name in {"release", measured}
        record = model.records["impact" if row.of == "impact" else next(iter(model.records))]
        absent[at[name]] = row.absent(Side(model, record))
    return Supposed(known, absent)


def deviation_alone(
    model: DropModel, estimate: Estimate, gradient: Array, common: Sequence[slice], degrees: float
) -> Deviation:
    """Return the deviation of a drop by itself.

    Parameters
    ----------
    gradient
        Of the result, in units of the prior uncertainties.
    common
        Unknowns that the drops of a session share.
    degrees
        Degrees of freedom of the result's own uncertainty.
    """
    known, absent = supposed(model)
    moved = estimate.covariance @ gradient
    true = np.where(known, 0.0, gradient)
    left = np.where(known, 0.0, true - moved) ** 2
    variance = true @ true - gradient @ moved + 2.0 * (gradient - true) @ moved - absent @ left
    left *= 1.0 - absent
    shared = math.fsum(float(left[block].sum()) for block in common)
    struck = "impact" in model.records
    return Deviation(
        max(0.0, float(variance) - shared),
        GUESSED if struck else degrees,
        (math.sqrt(shared),),
        (0.0,),
    )


def deviation_among(joint: JointFit, drop: JointDrop, gradient: Array, degrees: float) -> Deviation:
    """Return the deviation of a drop that was fitted with others.

    Parameters
    ----------
    gradient, degrees
        As in `deviation_alone`.
    """
    known, absent = supposed(drop.model)
    groups = drop.model.unknowns.groups
    # What is guessed counts for as much as its expanded uncertainty says.
    wider = (coverage_factor(GUESSED) / COVERAGE_95) ** 2
    for block in (block for name in _GUESSED & groups.keys() for block in groups[name]):
        absent[block] = 1.0 - wider
    true = np.where(known, 0.0, gradient)
    mine, here, size = drop.own, drop.here, len(joint.shared)
    told = gradient[mine] - true[mine]
    moves, whole, without, lost = (np.zeros(size) for _ in range(4))
    moves[here], lost[here] = true[drop.common], absent[drop.common]
    whole[here] = gradient[drop.common] - drop.gain.T @ gradient[mine]
    without[here] = drop.gain.T @ told
    root = joint.inverse  # whose product with its transpose is the common unknowns' covariance
    common = root @ (whole @ root)
    alone = drop.inverse @ (gradient[mine] @ drop.inverse)
    left = true[mine] - np.where(known[mine], 0.0, alone - drop.gain @ common[here])
    own = true[mine] @ true[mine] - gradient[mine] @ alone + 2.0 * told @ alone
    struck = "impact" in drop.model.records
    less, more = (np.sqrt(np.maximum(0.0, sign * lost)) * (moves - common) for sign in (1.0, -1.0))
    # hCh + h(Ce) + (eC)h is what h + e make, less what e makes; e = −Gᵀ of what is known.
    return Deviation(
        max(0.0, float(own - absent[mine] @ left**2)),
        joint.degrees.get("impulse", degrees) if struck else degrees,
        np.concatenate([moves, without @ root, more]),
        np.concatenate([(whole + without) @ root, less]),
    )
