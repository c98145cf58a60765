"""One Gauss–Newton step of many drops together, each one's own unknowns eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.equations import STRAY, linearize, scaled
from rig.analysis.fit import Matched
from rig.analysis.square_root import EquationRows, condensed, eliminate, square_root

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.square_root import Root
    from rig.analysis.unknowns import SharedUnknowns
    from rig.arrays import Array, Index


@dataclass(frozen=True, slots=True)
class JointDrop(Matched):
    """One drop among others, on the way to the joint solution or there.

    Attributes
    ----------
    own, common, here
        Its own unknowns and the common ones in the drop's vector, and the latter in the session's.
    inverse, gain
        As in `rig.analysis.square_root.Eliminated`.
    target
        What its own unknowns become for no step of the common ones, likewise.
    centre
        Prior means of its own unknowns, zero if not given.
    """

    own: Index
    common: Index
    here: Index
    inverse: Array
    gain: Array
    target: Array
    centre: Array | None = None

    @classmethod
    def of(cls, fit: Matched, shared: SharedUnknowns) -> JointDrop:
        """Take a drop as it was adjusted by itself, or among others before."""
        common, places = shared.places(fit.model)
        own = np.setdiff1d(np.arange(len(fit.model.unknowns)), common)
        gain = np.zeros((own.size, places.size))
        nothing = np.zeros(own.size)
        return cls(fit.model, fit.matches, fit.x, own, common, places, gain, gain, nothing)

    def at(self, common: Array) -> JointDrop:
        """Return it with other values of the session's common unknowns."""
        x = self.x.copy()
        x[self.common] = common[self.here]
        return replace(self, x=x)


def joint_step(
    drops: Sequence[JointDrop],
    x: Array,
    sd: Array,
    centre: Array | None = None,
    cut: float = STRAY,
) -> tuple[Root, list[JointDrop]]:
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
    Root, list of JointDrop
        In units of `sd`; and the drops with their own unknowns eliminated.
    """
    rows: list[EquationRows] = []
    reduced = []
    for drop in drops:
        own_sd, pull = drop.model.unknowns.sd, np.zeros(drop.x.size)
        off = drop.x[drop.own] if drop.centre is None else drop.x[drop.own] - drop.centre
        pull[drop.own] = scaled(off, own_sd[drop.own])
        blocks = [*linearize(drop.model, drop.matches, drop.x, cut=cut).rows.values()]
        inverse, gain, target, rest = eliminate(blocks, own_sd, pull, drop.own, drop.common)
        rows = condensed([*rows, rest._replace(columns=drop.here)], x.size)
        reduced.append(replace(drop, inverse=inverse, gain=gain, target=target))
    pull = scaled(x if centre is None else x - centre, sd)
    return square_root(rows, np.ones(x.size), pull), reduced


def take(
    drops: Sequence[JointDrop], x: Array, sd: Array, step: Array, share: float = 1.0
) -> tuple[Array, list[JointDrop]]:
    """Take a share of a step of the common unknowns, and of what each drop's own do then.

    Parameters
    ----------
    step
        In units of `sd`.
    """
    x = x + share * step * sd
    moved = []
    for drop in drops:
        state = drop.at(x)
        own = drop.target - drop.gain @ step[drop.here]
        state.x[drop.own] += share * drop.model.unknowns.sd[drop.own] * own
        moved.append(state)
    return x, moved
