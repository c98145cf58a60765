"""One Gauss–Newton step of many drops together, each one's own unknowns eliminated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.equations import STRAY, linearize, scaled
from rig.analysis.square_root import Root, eliminate, square_root

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel
    from rig.analysis.square_root import Eliminated

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
    reduced: Eliminated | None = None


def joint_step(
    drops: Sequence[DropState],
    x: Array,
    sd: Array,
    centre: Array | None = None,
    cut: float = STRAY,
) -> Root:
    """Reduce all drops to what they say together of what they have in common.

    Parameters
    ----------
    x, sd
        Common unknowns and their prior uncertainties.
    centre
        Prior means of the common unknowns, zero if not given.
    cut
        As for `rig.analysis.equations.linearize`.

    Returns
    -------
    Root
        In units of `sd`.
    """
    rows = []
    for drop in drops:
        own_sd = drop.model.unknowns.sd
        seen = linearize(drop.model, drop.matches, drop.x, cut=cut)
        pull = np.zeros(drop.x.size)
        off = drop.x[drop.own] if drop.centre is None else drop.x[drop.own] - drop.centre
        pull[drop.own] = scaled(off, own_sd[drop.own])
        drop.reduced = eliminate([*seen.rows.values()], own_sd, pull, drop.own, drop.common)
        rest = drop.reduced.rest
        rows.append(rest._replace(columns=drop.here))
    return square_root(rows, np.ones(x.size), scaled(x if centre is None else x - centre, sd))


def take(drops: Sequence[DropState], x: Array, sd: Array, step: Array, share: float = 1.0) -> Array:
    """Take a share of a step of the common unknowns, and of what each drop's own do then.

    Parameters
    ----------
    step
        In units of `sd`.

    Returns
    -------
    ndarray
        The common unknowns; the drops' own are moved in place.
    """
    x = x + share * step * sd
    for drop in drops:
        assert drop.reduced is not None
        own = drop.reduced.own - drop.reduced.gain @ step[drop.here]
        drop.x[drop.own] += share * drop.model.unknowns.sd[drop.own] * own
        # Its copy of the common unknowns follows, so that the next equations are made there.
        drop.x[drop.common] = x[drop.here]
    return x
