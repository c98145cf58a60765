"""Gauss–Newton steps of a joint fit, with each drop's own unknowns eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.equations import STRAY, linearize, standardise
from rig.analysis.fit import DropFit
from rig.analysis.square_root import EquationRows, condense, eliminate, square_root

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.square_root import Root
    from rig.analysis.unknowns import SharedUnknowns
    from rig.arrays import Array, Index


@dataclass(frozen=True, slots=True)
class JointDrop(DropFit):
    """A drop of a joint fit.

    Attributes
    ----------
    own, common, here
        Places of its own and of the shared unknowns in the drop's vector, and of the latter in the
        session's vector.
    inverse, gain
        As in `rig.analysis.square_root.Elimination`.
    target
        Step of its own unknowns for a zero step of the shared ones: `Elimination.own`.
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
    def of(cls, fit: DropFit, shared: SharedUnknowns) -> JointDrop:
        """Return a drop that was fitted by itself, or in an earlier joint fit."""
        common, places = shared.places(fit.model)
        own = np.setdiff1d(np.arange(len(fit.model.unknowns)), common)
        gain = np.zeros((own.size, places.size))
        nothing = np.zeros(own.size)
        return cls(fit.model, fit.matches, fit.x, own, common, places, gain, gain, nothing)

    def at(self, common: Array) -> JointDrop:
        """Return the drop with other values of the session's shared unknowns."""
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
    """Eliminate each drop's own unknowns, and return the information on the shared ones.

    Parameters
    ----------
    x, sd
        Shared unknowns and their prior uncertainties.
    centre
        Prior means of the shared unknowns, zero if not given.
    cut
        As for `rig.analysis.equations.linearize`.

    Returns
    -------
    Root, list of JointDrop
        Root in units of `sd`, and the drops with their own unknowns eliminated.
    """
    rows: list[EquationRows] = []
    reduced = []
    for drop in drops:
        own_sd, pull = drop.model.unknowns.sd, np.zeros(drop.x.size)
        off = drop.x[drop.own] if drop.centre is None else drop.x[drop.own] - drop.centre
        pull[drop.own] = standardise(off, own_sd[drop.own])
        blocks = [*linearize(drop.model, drop.matches, drop.x, cut=cut).rows.values()]
        inverse, gain, target, rest = eliminate(blocks, own_sd, pull, drop.own, drop.common)
        rows = condense([*rows, rest._replace(columns=drop.here)], x.size)
        reduced.append(replace(drop, inverse=inverse, gain=gain, target=target))
    pull = standardise(x if centre is None else x - centre, sd)
    return square_root(rows, np.ones(x.size), pull), reduced


def take(
    drops: Sequence[JointDrop], x: Array, sd: Array, step: Array, share: float = 1.0
) -> tuple[Array, list[JointDrop]]:
    """Return unknowns and drops after a share of a step of the shared unknowns.

    Each drop's own unknowns follow.

    Parameters
    ----------
    step
        Step in units of `sd`.
    """
    x = x + share * step * sd
    moved = []
    for drop in drops:
        state = drop.at(x)
        own = drop.target - drop.gain @ step[drop.here]
        state.x[drop.own] += share * drop.model.unknowns.sd[drop.own] * own
        moved.append(state)
    return x, moved
