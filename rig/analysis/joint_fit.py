"""Joint fit of all drops of a session: the rig's shared unknowns and each drop given these.

All drops form a single least-squares problem, with unknowns c of the rig and the chains that all
drops share, and unknowns of each drop alone. The latter are eliminated drop by drop (a Schur
complement), so the cost grows linearly with the number of drops. The variance components of the
nuisance parameters are estimated on the way (`rig.analysis.evidence`).
"""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from rig.analysis.adjust import STEPS, length
from rig.analysis.components import Components, priors
from rig.analysis.equations import STRAY, Residuals, standardise
from rig.analysis.evidence import Evidence
from rig.analysis.fit import DropFit, Fit
from rig.analysis.joint_step import (
    DropGroup,
    JointDrop,
    Places,
    group_drops,
    joint_step,
    with_priors,
)
from rig.analysis.likeness import Likeness, likeness
from rig.analysis.result import Measured
from rig.analysis.unknowns import SharedUnknowns
from rig.arrays import Array
from rig.plain_data import Record
from rig.protocol.protocol import GUESSED
from rig.threads import one_thread

FEWEST = 4
"""Least number of drops for a joint fit: a block of A, B, B, A."""
IDENTIFIED = 0.5
"""Least relative reduction of the prior variance for an unknown to count as identified."""
_FIRST = 2  # rounds until shared and own unknowns fit together, and until both rest
_DONE = 0.02
"""Last step in standard uncertainties, root mean square over independent sums of shared unknowns,
and last relative change of the components."""
_FASTER, _SLOWER = 1.2, 0.5
"""Factors on the pace of a component from round to round, as usual for Rprop (Riedmiller 1994): it
would creep, or alternate."""
_LEAST = {"floor": 5e-6, "departure": 5e-6, "few": 5e-6}
"""Components, m, below which others of the same variance dominate."""


@dataclass(frozen=True, slots=True)
class RigEstimate(Record):
    """Results of a joint fit about the rig, without the drops.

    Attributes
    ----------
    learned
        Result of `JointFit.json`.
    likeness
        Agreement of the falls with the model; `None` if there are too few edges.
    drag
        κ in g − κv², 1/m, if it is estimated and not stated.
    """

    MEMBERS = "learned likeness?"

    learned: Mapping[str, Any]
    likeness: Likeness | None
    drag: Measured | None


@dataclass(frozen=True)
class JointFit:
    """Result of a joint fit.

    Attributes
    ----------
    shared
        Blocks of the shared unknowns.
    x, sd, inverse
        Estimates (deviations from the protocol), prior standard uncertainties, and R⁻¹ of the
        information RᵀR in units of these.
    components, degrees
        Variance components, and the degrees of freedom of each.
    drops
        Fitted drops in the order given.
    settled
        Whether the fit converged; if not, `drops` may be empty.
    gains
        As for `rig.analysis.joint_step.DropGroup.add_gains`.
    """

    shared: SharedUnknowns
    x: Array
    sd: Array
    inverse: Array
    components: Components
    degrees: Mapping[str, float]
    drops: tuple[JointDrop, ...]
    settled: bool
    gains: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def covariance(self) -> Array:
        """Covariance R⁻¹R⁻ᵀ of the shared unknowns in units of `sd`."""
        return self.inverse @ self.inverse.T

    @property
    def rig(self) -> RigEstimate:
        """Results about the rig and the agreement of its falls with the model."""
        block, drag = self.shared.blocks.get("drag"), None
        # Predictions already include stated drag.
        if block is not None and self.drops[0].model.protocol.drag is None:
            u = math.sqrt(self.covariance.diagonal()[block][0]) * float(self.sd[block][0])
            drag = Measured(float(self.x[block][0]), u)
        return RigEstimate(self.json(), likeness(self), drag)

    def json(self) -> dict[str, Any]:
        """Return ``learned`` of `rig analyze --json`.

        Returns
        -------
        dict
            ``scatter``: each variance component as stated and as estimated, with its degrees of
            freedom; ``gates`` and ``rods`` are relative to the protocol's uncertainties.
            ``unknowns``: shared unknowns as deviations from the protocol in SI units, with prior
            and posterior standard uncertainties; marked as not identified if the edges do not
            determine them.
        """
        variance = np.diag(self.covariance)
        stated, found = priors(self.drops[0].model.protocol), self.components
        columns = {
            "value": self.x,
            "u": np.sqrt(variance) * self.sd,
            "prior_u": self.sd,
            "identified": variance <= 1.0 - IDENTIFIED,
        }
        return {
            "runs": len(self.drops),
            "scatter": [
                {"name": n, "stated": getattr(stated, n), "found": getattr(found, n), "degrees": nu}
                for n, nu in self.degrees.items()
            ],
            "unknowns": [
                {"name": name} | {key: values[block].tolist() for key, values in columns.items()}
                for name, block in self.shared.blocks.items()
                if self.sd[block].any()
            ],
        }


def by_itself(fit: Fit) -> JointFit:
    """Return the joint fit of a single drop without shared unknowns."""
    shared, x = SharedUnknowns(()), np.zeros(0)
    none = np.zeros(0, dtype=np.intp)
    places = Places(np.arange(fit.x.size), none, none)
    drop = JointDrop(fit.model, fit.matches, fit.x, places, fit.matches, fit.estimate)
    degrees = {"jitter": fit.estimate.degrees, "impulse": GUESSED}
    components, settled = fit.model.components, fit.estimate.settled
    return JointFit(shared, x, x, np.zeros((0, 0)), components, degrees, (drop,), settled)


@one_thread
def joint_fit(fits: Sequence[DropFit]) -> JointFit:
    """Fit all drops of a session together.

    Parameters
    ----------
    fits
        Good drops, each fitted by itself or in an earlier joint fit.
    """
    shared, groups = group_drops(fits)
    x, beforehand = np.zeros(len(shared)), priors(fits[0].model.protocol)
    evidence = Evidence(beforehand, beforehand)
    settled, rests, size, before = False, 0, len(shared), evidence.components
    pace, inverse = np.ones(size + len(before.__slots__)), np.eye(size)
    previous = 0.0 * pace
    for round_ in range(STEPS):  # few drops need many, as they determine the scatter poorly
        groups = with_priors([group.at(x) for group in groups], evidence.components)
        # In the first round shared and own unknowns do not fit together yet: cut no residuals.
        sd, root, groups = joint_step(groups, x, STRAY if round_ else math.inf)
        step = pace[:size] * root.step()
        # Once shared unknowns rest, halve steps: a drop's own may alternate about an impact.
        share = 0.5 ** max(0, rests - _FIRST)
        moves = _move(groups, x, sd, step, share) if np.isfinite(step).all() else None
        if moves is None:
            settled, groups = False, []
            break
        x, groups, residuals = moves
        inverse = np.linalg.inv(root.matrix).astype(np.float64, copy=False)
        before = evidence.components
        evidence = Evidence(before, beforehand)
        evidence.edges(residuals)
        _weigh(evidence, shared, x, sd, inverse, groups)
        settled = length(step, root.matrix) < _DONE * math.sqrt(size)
        rests = rests + 1 if settled else 0
        if settled and _steady(before, evidence.components, groups):
            break
        # A component that keeps its direction goes faster; what turns goes half as fast.
        grown = before.ratios(evidence.components)
        last, previous = previous, np.append(step, grown)
        if round_ > _FIRST:
            pace *= np.where(previous * last < 0.0, _SLOWER, _FASTER)
            pace[:size] = np.minimum(pace[:size], 1.0)
            pace[size:] = np.maximum(pace[size:], _SLOWER**2)
        leap = np.maximum(np.abs(grown), 1.0)  # only small changes are made faster
        evidence.components = before.times(np.clip(pace[size:] * grown, -leap, leap))
    gains = defaultdict[str, Array](partial(np.zeros, (size, size)))
    for group in groups:
        group.add_gains(gains)
    placed = dict(drop for group in groups for drop in group.split())
    drops = tuple(placed[n] for n in sorted(placed))
    # Return the components used for this solution, not the updated ones.
    return JointFit(shared, x, sd, inverse, before, evidence.degrees, drops, settled, gains)


def _move(
    groups: Sequence[DropGroup], x: Array, sd: Array, step: Array, share: float
) -> tuple[Array, list[DropGroup], list[Residuals]] | None:
    """Take a share of a step, shortened until all residuals are finite.

    Returns
    -------
    x, groups, residuals
        The shared unknowns, the drops, and the residuals of all edges; `None` if no part of the
        step gives finite residuals.
    """
    for _ in range(STEPS):
        common = x + share * step * sd
        moved = [group.move(common, step, share) for group in groups]
        remaining = [
            group.model.residuals(role, group.x, edges)
            for group in moved
            for role, edges in group.edges.items()
        ]
        if all(np.isfinite(residuals.values).all() for residuals in remaining):
            return common, moved, remaining
        share *= 0.5
    return None


def _weigh(
    evidence: Evidence,
    shared: SharedUnknowns,
    x: Array,
    sd: Array,
    inverse: Array,
    groups: Sequence[DropGroup],
) -> None:
    """Estimate the variance components from residuals and estimates."""
    remaining = np.sum(inverse**2, axis=1)
    for name, block in shared.blocks.items():
        places = np.arange(len(shared))[block]
        places = places[sd[places] > 0.0]
        root = inverse[places]
        evidence.members(shared.rows[name].scale, x[places] / sd[places], root @ root.T)
    parameters = float(np.sum((1.0 - remaining)[sd > 0.0]))
    struck = 0.0
    for group in groups:
        at, told = group.model.unknowns, np.zeros(group.x.shape)
        variances, blocks = group.told(inverse)
        told[:, group.places.own] = 1.0 - variances
        parameters += float(np.sum(told[:, at.sd > 0.0]))
        if "impulses" in at:
            struck += float(np.sum(told[:, at["impulses"]]))
        evidence.drops(group.model, standardise(group.x, at.sd), told, blocks)
    evidence.estimate_components(parameters, struck)


def _steady(old: Components, new: Components, groups: Sequence[DropGroup]) -> bool:
    """Whether the components have converged; a component that is absent shrinks for ever.

    For impulses the scatter at the drops' α is compared. If all have about the same α, the edges
    do not separate its components, and no result depends on them.
    """
    names = {*old.__slots__} - {"impulse", "impulse_floor", "bounce"}
    pairs = [(getattr(old, name), getattr(new, name), _LEAST.get(name, 0.0)) for name in names]
    alphas = {abs(group.model.alpha) for group in groups if "impact" in group.model.records}
    ends = np.array([1.0, math.inf])
    pairs += [
        (a, b, 0.0)
        for alpha in alphas
        for a, b in zip(old.impulses(alpha, ends), new.impulses(alpha, ends), strict=True)
    ]
    return all(abs(a - b) <= _DONE * max(b, least) for a, b, least in pairs)
