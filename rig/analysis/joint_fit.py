"""All drops of a session fitted together: what they say of the rig, and each in that light.

All drops together are one least-squares problem: unknowns c of the rig and the chains, the same in
every drop, and unknowns of each drop alone. The latter are eliminated drop by drop (a Schur
complement), so its cost grows with the number of drops and not with its cube. How much each kind
of nuisance scatters is estimated on the way (`rig.analysis.evidence`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.adjust import PATIENT
from rig.analysis.components import stated
from rig.analysis.equations import STRAY, scaled
from rig.analysis.evidence import Evidence
from rig.analysis.fit import Matched, match, without_strays
from rig.analysis.joint_step import DropState, joint_step, take
from rig.analysis.likeness import likeness
from rig.analysis.plain_data import attributes
from rig.analysis.result import Measured
from rig.analysis.unknowns import SharedUnknowns
from rig.protocol.protocol import GUESSED
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.components import Components
    from rig.analysis.equations import Residuals
    from rig.analysis.fit import Fit
    from rig.analysis.likeness import Likeness

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Matches = dict[str, list[Index]]

FEWEST = 4
"""Drops that a session must have for a joint fit: one block of A, B, B, A."""
IDENTIFIED = 0.5
"""Share of the prior variance that the edges must take away for an unknown to be found by them."""
_ROUNDS = 60  # of which few drops need many, for they tell little of the scatter
_REMATCH = 2  # rounds after which all edges are matched again: beams and rods are known by then
_DONE = 0.02  # of a standard uncertainty
_SHORTEST = 1e-6  # share of a step, less of which is none
_STEADY = 0.02  # relative change of the components
_LEAST = {"floor": 5e-6, "departure": 5e-6, "few": 5e-6}
"""Where others of their kind count for more."""


@dataclass(frozen=True, slots=True)
class JointDrop(Matched):
    """One drop after all have been fitted together.

    Attributes
    ----------
    x
        Unknowns of the joint solution.
    own, common, here
        Its own unknowns and the common ones in the drop's vector, and the latter in the session's.
    inverse, gain
        As in `rig.analysis.square_root.Eliminated`.
    """

    x: Array
    own: Index
    common: Index
    here: Index
    inverse: Array
    gain: Array


@dataclass(frozen=True, slots=True)
class RigEstimate:
    """What the drops of a session say together of their rig, without the drops.

    Attributes
    ----------
    learned
        As `JointFit.json` gives it.
    likeness
        How far the falls are from the model; `None` where too few edges tell it.
    drag
        κ in g − κv², 1/m, where it is an unknown and not stated.
    """

    learned: Mapping[str, Any]
    likeness: Likeness | None
    drag: Measured | None


@dataclass(frozen=True)
class JointFit:
    """What the drops of a session say together.

    Attributes
    ----------
    shared
        Names of the common unknowns.
    x, sd, inverse
        Estimates (deviations from the protocol), prior standard uncertainties, and R⁻¹ of the
        information RᵀR in units of these.
    components, degrees
        How much everything scatters, and how many degrees of freedom each of these numbers has.
    drops
        In the order given.
    settled
        Whether the steps came to an end; if not, there may be no drops.
    """

    shared: SharedUnknowns
    x: Array
    sd: Array
    inverse: Array
    components: Components
    degrees: Mapping[str, float]
    drops: tuple[JointDrop, ...]
    settled: bool

    @cached_property
    def covariance(self) -> Array:
        """R⁻¹R⁻ᵀ: covariance of the common unknowns in units of `sd`."""
        return self.inverse @ self.inverse.T

    @property
    def rig(self) -> RigEstimate:
        """What is said of the rig and its falls."""
        block, drag = self.shared.blocks.get("drag"), None
        # Where air is stated, predictions are made in it.
        if block is not None and self.drops[0].model.protocol.drag is None:
            u = math.sqrt(self.covariance.diagonal()[block][0]) * float(self.sd[block][0])
            drag = Measured(float(self.x[block][0]), u)
        return RigEstimate(self.json(), likeness(self), drag)

    def json(self) -> dict[str, Any]:
        """``learned`` of `rig analyze --json`.

        Returns
        -------
        dict
            ``scatter``: each variance component as stated and as found, with its degrees of
            freedom; ``gates`` and ``rods`` are relative to the protocol's uncertainties.
            ``unknowns``: what the drops have in common, as deviations from the protocol in SI
            units, with the standard uncertainties before and after; what the edges do not tell is
            marked as not identified.
        """
        variance = np.diag(self.covariance)
        beforehand = attributes(stated(self.drops[0].model.protocol), *self.degrees)
        scatter = attributes(self.components, *self.degrees)
        columns = {
            "value": self.x,
            "u": np.sqrt(variance) * self.sd,
            "prior_u": self.sd,
            "identified": variance <= 1.0 - IDENTIFIED,
        }
        return {
            "runs": len(self.drops),
            "scatter": [
                {"name": name, "stated": known, "found": scatter[name], "degrees": degrees}
                for (name, degrees), known in zip(
                    self.degrees.items(), beforehand.values(), strict=True
                )
            ],
            "unknowns": [
                {"name": name} | {key: values[block].tolist() for key, values in columns.items()}
                for name, block in self.shared.blocks.items()
                if self.sd[block].any()
            ],
        }


def by_itself(fit: Fit) -> JointFit:
    """Take a drop that was adjusted by itself for a session that has nothing in common."""
    estimate, model = fit.estimate, fit.model
    nothing, all_own = np.zeros(0, dtype=np.intp), np.arange(fit.x.size)
    gain = np.zeros((fit.x.size, 0))
    drop = JointDrop(model, fit.matches, fit.x, all_own, nothing, nothing, estimate.inverse, gain)
    degrees = {"jitter": estimate.degrees, "impulse": GUESSED}
    shared, x = SharedUnknowns(()), np.zeros(0)
    return JointFit(shared, x, x, gain[:0], model.components, degrees, (drop,), estimate.settled)


@one_thread
def joint_fit(fits: Sequence[Fit | JointDrop]) -> JointFit:
    """Adjust all drops of a session together.

    Parameters
    ----------
    fits
        Good drops, each adjusted by itself, or all of them before.
    """
    shared = SharedUnknowns(fit.model for fit in fits)
    # One clock a rig: its error is common, and as large as the least sure calibration allows.
    clock_u: dict[str | None, float] = {}
    for model in (fit.model for fit in fits):
        rig = model.owners.get("rig")
        clock_u[rig] = max(model.clock_u, clock_u.get(rig, 0.0))
    drops = [_begin(fit, shared) for fit in fits]
    x = _average(drops, shared)
    beforehand = stated(fits[0].model.protocol)
    evidence = Evidence(beforehand, beforehand)
    settled, moved, damping, previous = False, 0.0, 1.0, np.zeros(len(shared))
    inverse, before = np.eye(len(shared)), evidence.components
    for round_ in range(_ROUNDS):
        sd = np.zeros(len(shared))
        for drop in drops:
            # Priors follow the scatter that was found, and impulses the α that was found.
            rig = drop.model.owners.get("rig")
            drop.model = drop.model.informed(evidence.components, clock_u[rig], drop.x)
            drop.x[drop.common] = x[drop.here]
            if round_ == _REMATCH:
                drop.matches = match(drop.model, drop.x)
            sd[drop.here] = drop.model.unknowns.sd[drop.common]
        # At first the common unknowns are not yet what a drop's own go with: all may be far off.
        root = joint_step(drops, x, sd, cut=STRAY if round_ else math.inf)
        step = root.step()
        moves = _move(drops, x, sd, step, damping) if np.isfinite(step).all() else None
        if moves is None:
            return JointFit(shared, x, sd, inverse, before, evidence.degrees, (), settled=False)
        x, left, damping = moves
        inverse = np.linalg.inv(root.matrix).astype(np.float64, copy=False)
        variance = np.sum(inverse**2, axis=1)
        ahead = step / np.sqrt(variance)
        last, moved = moved, damping * float(np.abs(ahead).max())
        if round_ > PATIENT and ahead @ previous < 0.0:
            damping *= 0.5
        previous = ahead
        before = evidence.components
        evidence = _weigh(evidence, shared, x, sd, inverse, drops, left)
        # As long as steps get shorter alike, the next one is that of the last times their ratio.
        settled = round_ > _REMATCH and (moved < _DONE or moved**2 < _DONE * last)
        if settled and _steady(before, evidence.components, drops):
            break
    return JointFit(
        shared,
        x,
        sd,
        inverse,
        before,  # those that the solution was made with
        evidence.degrees,
        tuple(_jointly_fitted(drop) for drop in drops),
        settled,
    )


def _move(
    drops: Sequence[DropState], x: Array, sd: Array, step: Array, share: float
) -> tuple[Array, list[Residuals], float] | None:
    """Take a step, or as much of it as leads to where chains fall.

    Returns
    -------
    x, left, share
        The common unknowns, what all edges leave over, and how much of the step was taken; nothing
        where no part of it will do.
    """
    begin = [drop.x.copy() for drop in drops]
    while share > _SHORTEST:
        there = take(drops, x, sd, step, share)
        left = [
            drop.model.residuals(role, drop.x, match)
            for drop in drops
            for role, match in drop.matches.items()
        ]
        if all(np.isfinite(one.values).all() for one in left):
            return there, left, share
        for drop, at in zip(drops, begin, strict=True):
            drop.x[:] = at
        share *= 0.5
    return None


def _begin(fit: Fit | JointDrop, shared: SharedUnknowns) -> DropState:
    common, here = shared.places(fit.model)
    own = np.setdiff1d(np.arange(len(fit.model.unknowns)), common)
    return DropState(fit.model, fit.matches, fit.x.copy(), own, common, here)


def _average(drops: Sequence[DropState], shared: SharedUnknowns) -> Array:
    """Begin at the mean of what the drops say by themselves."""
    total, count = np.zeros(len(shared)), np.zeros(len(shared))
    for drop in drops:
        total[drop.here] += drop.x[drop.common]
        count[drop.here] += 1.0
    return total / count


def _weigh(
    evidence: Evidence,
    shared: SharedUnknowns,
    x: Array,
    sd: Array,
    inverse: Array,
    drops: Sequence[DropState],
    left: Sequence[Residuals],
) -> Evidence:
    """Estimate the components anew from what is left over and what was found."""
    new = Evidence(evidence.components, evidence.stated)
    remaining = np.sum(inverse**2, axis=1)
    for name, block in shared.blocks.items():
        scale = shared.rows[name].scale
        new.common(scale, scaled(x, sd)[block], remaining[block], sd[block])
    parameters = float(np.sum((1.0 - remaining)[sd > 0.0]))
    struck = 0.0
    for drop in drops:
        assert drop.reduced is not None
        reduced, model = drop.reduced, drop.model
        # The variance of an own unknown: with the common ones known, and what these leave open.
        by_common = reduced.gain @ inverse[drop.here]
        variances = np.sum(reduced.inverse**2, axis=1) + np.sum(by_common**2, axis=1)
        own_sd = model.unknowns.sd[drop.own]
        variance = np.zeros(drop.x.size)
        variance[drop.own] = variances
        parameters += float(np.sum((1.0 - variances)[own_sd > 0.0]))
        if "impulses" in model.unknowns:
            struck += float(np.sum(1.0 - variance[model.unknowns["impulses"]]))
        new.drop(model, scaled(drop.x, model.unknowns.sd), variance)
    new.edges(left)
    return new.settled(parameters, struck)


def _steady(one: Components, other: Components, drops: Sequence[DropState]) -> bool:
    """Whether no component changes much; a floor that is not there shrinks for ever.

    Of impulses it is their scatter in these drops that counts: where all have about the same α, it
    does not tell its two components apart, and nothing depends on them.
    """
    names = [name for name in one.__slots__ if name not in ("impulse", "impulse_floor", "bounce")]
    pairs = [(getattr(one, name), getattr(other, name), _LEAST.get(name, 0.0)) for name in names]
    alphas = {
        abs(drop.model.guesses["impact"].alpha) for drop in drops if "impact" in drop.model.guesses
    }
    ends = np.array([1.0, math.inf])
    pairs += [
        (a, b, 0.0)
        for alpha in alphas
        for a, b in zip(one.impulses(alpha, ends), other.impulses(alpha, ends), strict=True)
    ]
    return all(abs(a - b) <= _STEADY * max(b, least) for a, b, least in pairs)


def _jointly_fitted(drop: DropState) -> JointDrop:
    assert drop.reduced is not None
    return JointDrop(
        drop.model,
        without_strays(drop.model, drop.x, drop.matches),
        drop.x,
        drop.own,
        drop.common,
        drop.here,
        drop.reduced.inverse,
        drop.reduced.gain,
    )
