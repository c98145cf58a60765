"""One Gauss–Newton step of many drops together, each one's own unknowns eliminated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.equations import STRAY, NormalEquations, normal_equations, scaled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Matches = dict[str, list[Index]]


@dataclass(slots=True)
class DropState:
    """One drop on the way.

    Attributes
    ----------
    model, matches, x
        Its equations and unknowns.
    own, common, here
        As in `rig.analysis.joint_fit.JointDrop`.
    centre
        Prior means of its own unknowns, zero if not given.
    reduced
        Its equations at the last step.
    """

    model: DropModel
    matches: Matches
    x: Array
    own: Index
    common: Index
    here: Index
    centre: Array | None = None
    reduced: Reduced | None = None


class Reduced(NamedTuple):
    """A drop's equations with its own unknowns o eliminated, all in units of prior uncertainties.

    Attributes
    ----------
    inverse
        A⁻¹ of the drop's own unknowns, prior included.
    gain
        G = A⁻¹B: o = o₀ − G c.
    matrix, vector
        What the drop says of c: N_cc − BᵀG, and the right-hand side.
    own
        o₀.
    """

    inverse: Array
    gain: Array
    matrix: Array
    vector: Array
    own: Array


def joint_step(
    drops: Sequence[DropState],
    x: Array,
    sd: Array,
    centre: Array | None = None,
    cut: float = STRAY,
    damping: float = 1.0,
) -> tuple[Array, Array]:
    """Take one Gauss–Newton step of all drops together; moves their own unknowns in place.

    Parameters
    ----------
    x, sd
        Common unknowns and their prior uncertainties.
    centre
        Prior means of the common unknowns, zero if not given.
    cut
        As for `rig.analysis.equations.normal_equations`.
    damping
        Which share of the step is taken.

    Returns
    -------
    covariance, step
        Of the common unknowns, in units of `sd`; the whole step.
    """
    total = np.eye(x.size)
    vector = scaled(-x if centre is None else centre - x, sd)
    for drop in drops:
        found = normal_equations(drop.model, drop.matches, drop.x, drop.model.unknowns.sd, cut=cut)
        drop.reduced = reduced = _eliminate(drop, found)
        total[np.ix_(drop.here, drop.here)] += reduced.matrix
        vector[drop.here] += reduced.vector
    # The inverse itself is wanted: variances of all common unknowns, of every drop, from each step.
    covariance = np.linalg.inv(total).astype(np.float64, copy=False)
    step = covariance @ vector
    for drop in drops:
        assert drop.reduced is not None
        scale = drop.model.unknowns.sd[drop.own]
        own = drop.reduced.own - drop.reduced.gain @ step[drop.here]
        drop.x[drop.own] += damping * scale * own
        # Its copy of the common unknowns follows, so that the next equations are made there.
        drop.x[drop.common] = (x + damping * step * sd)[drop.here]
    return covariance, step


def _eliminate(drop: DropState, found: NormalEquations) -> Reduced:
    """Solve for the drop's own unknowns, given the common ones."""
    own, common = drop.own, drop.common
    sd = drop.model.unknowns.sd
    inverse = np.linalg.inv(found.matrix[np.ix_(own, own)] + np.eye(own.size)).astype(
        np.float64, copy=False
    )
    cross = found.matrix[np.ix_(own, common)]
    gain = inverse @ cross
    off = drop.x[own] if drop.centre is None else drop.x[own] - drop.centre
    pull = -found.vector[own] - scaled(off, sd[own])
    return Reduced(
        inverse,
        gain,
        found.matrix[np.ix_(common, common)] - cross.T @ gain,
        -found.vector[common] - gain.T @ pull,
        inverse @ pull,
    )
