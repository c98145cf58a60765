"""All drops of a session fitted together: what they say of the rig, and each in that light.

All drops together are one least-squares problem: unknowns c of the rig and the chains, the same in
every drop, and unknowns of each drop alone. The latter are eliminated drop by drop (a Schur
complement), so its cost grows with the number of drops and not with its cube. How much each kind
of nuisance scatters is estimated on the way (`rig.analysis.evidence`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.components import stated
from rig.analysis.equations import STRAY, scaled
from rig.analysis.evidence import Evidence
from rig.analysis.fit import match, without_strays
from rig.analysis.joint_step import JointDrop, joint_step, take
from rig.analysis.likeness import likeness
from rig.analysis.plain_data import attributes
from rig.analysis.result import Measured
from rig.analysis.unknowns import SharedUnknowns
from rig.protocol.protocol import GUESSED
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.components import Components
    from rig.analysis.equations import Residuals
    from rig.analysis.fit import Fit, Matched
    from rig.analysis.likeness import Likeness
    from rig.arrays import Array


FEWEST = 4
"""Drops that a session must have for a joint fit: one block of A, B, B, A."""
IDENTIFIED = 0.5
"""Share of the prior variance that the edges must take away for an unknown to be found by them."""
_ROUNDS = 60  # of which few drops need many, for they tell little of the scatter
_REMATCH = 2
"""Rounds after which all edges are matched again, for beams and rods are known by then, and a step
back is no part of finding the way."""
_DONE = 0.02  # of a standard uncertainty
_SHORTEST = 1e-6  # share of a step, less of which is none
_STEADY = 0.02  # relative change of the components
_LEAST = {"floor": 5e-6, "departure": 5e-6, "few": 5e-6}
"""Where others of their kind count for more."""


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
                {"name": name, "stated": prior, "found": scatter[name], "degrees": degrees}
                for (name, degrees), prior in zip(
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
    shared, x = SharedUnknowns(()), np.zeros(0)
    drop = replace(JointDrop.of(fit, shared), inverse=fit.estimate.inverse)
    degrees = {"jitter": fit.estimate.degrees, "impulse": GUESSED}
    components, settled = fit.model.components, fit.estimate.settled
    return JointFit(shared, x, x, np.zeros((0, 0)), components, degrees, (drop,), settled)


@one_thread
def joint_fit(fits: Sequence[Matched]) -> JointFit:
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
    drops = [JointDrop.of(fit, shared) for fit in fits]
    x = _average(drops, len(shared))
    beforehand = stated(fits[0].model.protocol)
    evidence = Evidence(beforehand, beforehand)
    settled, moved, size, before = False, 0.0, len(shared), evidence.components
    inverse, previous = np.eye(size), np.zeros(size + len(before.__slots__))
    damping = np.ones_like(previous)
    for round_ in range(_ROUNDS):
        sd, drops = np.zeros(size), [drop.at(x) for drop in drops]
        # Priors follow the scatter that was found, and impulses the α that was found.
        for n, drop in enumerate(drops):
            u = clock_u[drop.model.owners.get("rig")]
            model = drop.model.informed(evidence.components, u, drop.x)
            drops[n], sd[drop.here] = replace(drop, model=model), model.unknowns.sd[drop.common]
        if round_ == _REMATCH:
            drops = [replace(drop, matches=match(drop.model, drop.x)) for drop in drops]
        # At first the common unknowns are not yet what a drop's own go with: all may be far off.
        root, drops = joint_step(drops, x, sd, cut=STRAY if round_ else math.inf)
        step = damping[:size] * root.step()
        moves = _move(drops, x, sd, step) if np.isfinite(step).all() else None
        if moves is None:
            return JointFit(shared, x, sd, inverse, before, evidence.degrees, (), settled=False)
        x, drops, residuals = moves
        inverse = np.linalg.inv(root.matrix).astype(np.float64, copy=False)
        variance = np.sum(inverse**2, axis=1)
        last, moved = moved, float(np.abs(step / np.sqrt(variance)).max())
        before = evidence.components
        evidence = _weigh(evidence, shared, x, sd, inverse, drops, residuals)
        # As long as steps get shorter alike, the next one is that of the last times their ratio.
        settled = round_ > _REMATCH and (moved < _DONE or moved**2 < _DONE * last)
        if settled and _steady(before, evidence.components, drops):
            break
        # What flips to and fro, as beside a least scale that is believed, is met half-way.
        ratios = damping[size:] * before.ratios(evidence.components)
        evidence.components = before.times(ratios)
        ahead = np.concatenate([step, ratios])
        if round_ > _REMATCH:
            damping[ahead * previous < 0.0] *= 0.5
        previous = ahead
    # Components are those that the solution was made with.
    good = tuple(
        replace(drop, matches=without_strays(drop.model, drop.x, drop.matches)) for drop in drops
    )
    return JointFit(shared, x, sd, inverse, before, evidence.degrees, good, settled)


def _move(
    drops: Sequence[JointDrop], x: Array, sd: Array, step: Array
) -> tuple[Array, list[JointDrop], list[Residuals]] | None:
    """Take a step, or as much of it as leads to where chains fall.

    Returns
    -------
    x, drops, left
        The common unknowns, the drops there, and what all edges leave over; nothing where no part
        of the step will do.
    """
    share = 1.0
    while share > _SHORTEST:
        common, moved = take(drops, x, sd, step, share)
        remaining = [
            drop.model.residuals(role, drop.x, match)
            for drop in moved
            for role, match in drop.matches.items()
        ]
        if all(np.isfinite(residuals.values).all() for residuals in remaining):
            return common, moved, remaining
        share *= 0.5
    return None


def _average(drops: Sequence[JointDrop], size: int) -> Array:
    """Begin at the mean of what the drops say by themselves."""
    places = np.concatenate([drop.here for drop in drops])
    total = np.bincount(places, np.concatenate([drop.x[drop.common] for drop in drops]), size)
    return total / np.bincount(places, minlength=size)


def _weigh(
    evidence: Evidence,
    shared: SharedUnknowns,
    x: Array,
    sd: Array,
    inverse: Array,
    drops: Sequence[JointDrop],
    residuals: Sequence[Residuals],
) -> Evidence:
    """Estimate the components anew from what is left over and what was found."""
    new = Evidence(evidence.components, evidence.stated)
    remaining = np.sum(inverse**2, axis=1)
    for name, block in shared.blocks.items():
        places = np.arange(len(shared))[block]
        places = places[sd[places] > 0.0]
        new.members(shared.rows[name].scale, x[places] / sd[places], inverse[places])
    parameters = float(np.sum((1.0 - remaining)[sd > 0.0]))
    struck = 0.0
    for drop in drops:
        model = drop.model
        # The variance of an own unknown: with the common ones known, and what these leave open.
        by_common = drop.gain @ inverse[drop.here]
        root = np.zeros((drop.x.size, drop.own.size + x.size))
        root[drop.own] = np.hstack([drop.inverse, by_common])
        told = 1.0 - np.sum(root**2, axis=1)
        own_sd = model.unknowns.sd[drop.own]
        parameters += float(np.sum(told[drop.own][own_sd > 0.0]))
        if "impulses" in model.unknowns:
            struck += float(np.sum(told[model.unknowns["impulses"]]))
        new.drop(model, scaled(drop.x, model.unknowns.sd), root)
    new.edges(residuals)
    return new.settled(parameters, struck)


def _steady(old: Components, new: Components, drops: Sequence[JointDrop]) -> bool:
    """Whether no component changes much; a floor that is not there shrinks for ever.

    Of impulses it is their scatter in these drops that counts: where all have about the same α, it
    does not tell its two components apart, and nothing depends on them.
    """
    names = [name for name in old.__slots__ if name not in ("impulse", "impulse_floor", "bounce")]
    pairs = [(getattr(old, name), getattr(new, name), _LEAST.get(name, 0.0)) for name in names]
    alphas = {
        abs(drop.model.guesses["impact"].alpha) for drop in drops if "impact" in drop.model.guesses
    }
    ends = np.array([1.0, math.inf])
    pairs += [
        (a, b, 0.0)
        for alpha in alphas
        for a, b in zip(old.impulses(alpha, ends), new.impulses(alpha, ends), strict=True)
    ]
    return all(abs(a - b) <= _STEADY * max(b, least) for a, b, least in pairs)
