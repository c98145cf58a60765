"""What all drops of a session teach about the rig, and each drop in the light of it.

All drops together are one least-squares problem: unknowns c of the rig and the chains, the same in
every drop, and unknowns of each drop alone. The latter are eliminated drop by drop (a Schur
complement), so its cost grows with the number of drops and not with its cube. How much each kind
of nuisance scatters is estimated on the way (`rig.analysis.evidence`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.components import STATED
from rig.analysis.evidence import Evidence
from rig.analysis.fit import Matched, match, without_strays
from rig.analysis.normal import STRAY, Normal, normal
from rig.analysis.shared import Shared

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.components import Components
    from rig.analysis.drop_model import DropModel
    from rig.analysis.fit import Fit

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Matches = dict[str, list[Index]]

FEWEST = 4
"""Drops that a session must have to be learned from: one block of A, B, B, A."""
_ROUNDS = 30  # of which few drops need many, for they tell little of the scatter
_REMATCH = 2  # rounds after which all edges are matched again
_DONE = 0.02  # of a standard unremainingty
_STEADY = 0.02  # relative change of the components
_LEAST = {"floor": 5e-6, "impulse_floor": 5e-4}  # where others of their kind count for more


@dataclass(slots=True)
class _Drop:
    """One drop on the way: its model, its matches, where its unknowns are, its last equations."""

    model: DropModel
    matches: Matches
    x: Array
    own: Index
    common: Index
    here: Index
    part: Part | None = None


class Part(NamedTuple):
    """A drop's equations with its own unknowns o eliminated, all in units of prior unremainingties.

    Attributes
    ----------
    inverse
        A⁻¹ of the drop's own unknowns, prior included.
    gain
        G = A⁻¹B: o = o₀ − G c.
    reduced, vector
        What the drop says of c: N_cc − BᵀG, and the right-hand side.
    own
        o₀.
    """

    inverse: Array
    gain: Array
    reduced: Array
    vector: Array
    own: Array


@dataclass(frozen=True, slots=True)
class Taught(Matched):
    """One drop after all have been adjusted together.

    Attributes
    ----------
    x
        Unknowns of the joint solution.
    own, common, here
        Its own unknowns and the common ones in the drop's vector, and the latter in the session's.
    inverse, gain
        As in `Part`.
    """

    x: Array
    own: Index
    common: Index
    here: Index
    inverse: Array
    gain: Array


@dataclass(frozen=True, slots=True)
class Lesson:
    """What a session teaches.

    Attributes
    ----------
    shared
        Names of the common unknowns.
    x, sd, covariance
        Estimates (deviations from the protocol), prior standard unremainingties, and covariance in
        units of these.
    components, degrees
        How much everything scatters, and how many degrees of freedom each of these numbers has.
    drops
        In the order given.
    settled
        Whether the steps came to an end.
    """

    shared: Shared
    x: Array
    sd: Array
    covariance: Array
    components: Components
    degrees: Mapping[str, float]
    drops: tuple[Taught, ...]
    settled: bool


def learn(fits: Sequence[Fit]) -> Lesson:
    """Adjust all drops of a session together.

    Parameters
    ----------
    fits
        Good drops, each adjusted by itself.
    """
    shared = Shared(fit.model for fit in fits)
    # One clock for all: its error is common, and as large as the least sure calibration allows.
    clock_u = max(fit.model.clock_u for fit in fits)
    drops = [_begin(fit, shared) for fit in fits]
    x = _average(drops, shared)
    evidence = Evidence(STATED)
    settled = False
    for round_ in range(_ROUNDS):
        sd = np.zeros(len(shared))
        for drop in drops:
            drop.model = drop.model.informed(evidence.components, clock_u, drop.x)
            drop.x[drop.common] = x[drop.here]
            if round_ == _REMATCH:
                drop.matches = match(drop.model, drop.x)
            sd[drop.here] = drop.model.unknowns.sd[drop.common]
        total, vector = np.eye(len(shared)), -_scaled(x, sd)
        normals = []
        for drop in drops:
            found = normal(drop.model, drop.matches, drop.x, drop.model.unknowns.sd, cut=STRAY)
            drop.part = part = _eliminate(drop, found)
            total[np.ix_(drop.here, drop.here)] += part.reduced
            vector[drop.here] += part.vector
            normals.append(found)
        covariance = np.linalg.inv(total).astype(np.float64, copy=False)
        step = covariance @ vector
        x = x + step * sd
        for drop in drops:
            assert drop.part is not None
            scale = drop.model.unknowns.sd[drop.own]
            drop.x[drop.own] += scale * (drop.part.own - drop.part.gain @ step[drop.here])
            drop.x[drop.common] = x[drop.here]
        moved = float((np.abs(step) / np.sqrt(np.diag(covariance))).max())
        before = evidence.components
        evidence = _weigh(evidence, shared, x, sd, covariance, drops, normals)
        settled = round_ > _REMATCH and moved < _DONE
        if settled and _steady(before, evidence.components):
            break
    return Lesson(
        shared,
        x,
        sd,
        covariance,
        before,
        evidence.degrees,
        tuple(_taught(drop) for drop in drops),
        settled,
    )


def _begin(fit: Fit, shared: Shared) -> _Drop:
    common, here = shared.places(fit.model)
    own = np.setdiff1d(np.arange(len(fit.model.unknowns)), common)
    return _Drop(fit.model, fit.matches, fit.estimate.x.copy(), own, common, here)


def _average(drops: Sequence[_Drop], shared: Shared) -> Array:
    """Begin at the mean of what the drops say by themselves."""
    total, count = np.zeros(len(shared)), np.zeros(len(shared))
    for drop in drops:
        total[drop.here] += drop.x[drop.common]
        count[drop.here] += 1.0
    return total / count


def _eliminate(drop: _Drop, found: Normal) -> Part:
    """Solve for the drop's own unknowns, given the common ones."""
    own, common = drop.own, drop.common
    sd = drop.model.unknowns.sd
    inverse = np.linalg.inv(found.matrix[np.ix_(own, own)] + np.eye(own.size)).astype(
        np.float64, copy=False
    )
    cross = found.matrix[np.ix_(own, common)]
    gain = inverse @ cross
    pull = -found.vector[own] - _scaled(drop.x[own], sd[own])
    return Part(
        inverse,
        gain,
        found.matrix[np.ix_(common, common)] - cross.T @ gain,
        -found.vector[common] - gain.T @ pull,
        inverse @ pull,
    )


def _scaled(x: Array, sd: Array) -> Array:
    """In units of the prior unremainingty; what is known exactly stays."""
    return np.divide(x, sd, out=np.zeros_like(x), where=sd > 0.0)


def _weigh(
    evidence: Evidence,
    shared: Shared,
    x: Array,
    sd: Array,
    covariance: Array,
    drops: Sequence[_Drop],
    normals: Sequence[Normal],
) -> Evidence:
    """Estimate the components anew from what is left over and what was found."""
    new = Evidence(evidence.components)
    remaining = np.diag(covariance)
    for name, block in shared.blocks.items():
        new.common(name, _scaled(x, sd)[block], remaining[block], sd[block])
    parameters = float(np.sum((1.0 - remaining)[sd > 0.0]))
    for drop, found in zip(drops, normals, strict=True):
        assert drop.part is not None
        part, model = drop.part, drop.model
        left = np.diag(part.inverse) + np.einsum(
            "ij,jk,ik->i", part.gain, covariance[np.ix_(drop.here, drop.here)], part.gain,
            optimize=True,
        )  # fmt: skip
        own_sd = model.unknowns.sd[drop.own]
        parameters += float(np.sum((1.0 - left)[own_sd > 0.0]))
        variance = np.zeros(drop.x.size)
        variance[drop.own] = left
        new.drop(model, _scaled(drop.x, model.unknowns.sd), variance)
        new.edges(found.equations)
    return new.settled(parameters)


def _steady(one: Components, other: Components) -> bool:
    """Whether no component changes much; a floor that is not there shrinks for ever."""
    return all(
        abs(getattr(one, name) - getattr(other, name))
        <= _STEADY * max(getattr(other, name), _LEAST.get(name, 0.0))
        for name in one.__slots__
    )


def _taught(drop: _Drop) -> Taught:
    assert drop.part is not None
    return Taught(
        drop.model,
        without_strays(drop.model, drop.x, drop.matches),
        drop.x,
        drop.own,
        drop.common,
        drop.here,
        drop.part.inverse,
        drop.part.gain,
    )
