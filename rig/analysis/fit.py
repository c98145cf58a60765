"""Fit of a single drop: matching and least squares in turn."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rig.analysis.adjust import Estimate, adjust
from rig.analysis.annealing import PART, count_matched, log_density, matched
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import HUBER, STRAY
from rig.arrays import Array, Index

Matches = dict[str, Index]


class Begun(NamedTuple):
    """α, matches and unknowns of a drop, without its model."""

    alpha: float
    matches: Matches
    x: Array


_FINE = 0.8e-3  # m, standard deviation of an edge about a fitted trajectory, for matching
_ROUNDS = 6
_MEDIAN = 0.6745
"""Median of the absolute values of a standard normal distribution."""


@dataclass(frozen=True, slots=True, eq=False)
class DropFit:
    """A drop with matched edges and fitted unknowns.

    Attributes
    ----------
    x
        Fitted unknowns, shape ``(unknowns,)``.
    """

    model: DropModel
    matches: Matches
    x: Array

    @property
    def begun(self) -> Begun:
        """α, matches and unknowns, to be kept or to begin another fit with."""
        return Begun(self.model.alpha, self.matches, self.x)

    @property
    def match_count(self) -> int:
        """Number of matched edges."""
        return sum(map(count_matched, self.matches.values()))

    @property
    def shares(self) -> dict[str, float]:
        """Matched share of each side's expected edges, by role."""
        records = self.model.records
        return {
            role: count_matched(match) / max(1, records[role].edge_count)
            for role, match in self.matches.items()
        }

    def rods_of(self, edges: int) -> tuple[int, ...]:
        """Return the rod of each of the drop's edges, −1 if it belongs to none."""
        rods = np.full(edges, -1)
        for role, record in self.model.records.items():
            pick, edge = matched(self.matches[role])
            rods[record.edges.number[edge]] = record.due.rods[pick]
        return tuple(rods.tolist())


@dataclass(frozen=True, eq=False)
class Fit(DropFit):
    """A drop fitted by itself."""

    estimate: Estimate

    @cached_property
    def evidence(self) -> float:
        """Logarithm of the marginal likelihood, up to a constant for the same edges.

        A matched edge contributes the density of its time about the fitted motion; missed edges and
        strays contribute their prior rates. The unknowns are integrated out by Laplace's method:
        −½‖y‖² − ln |det R| at the best estimate, with y and RᵀR in units of the prior
        uncertainties.
        """
        estimate, model = self.estimate, self.model
        total = simultaneous(model, self.x) + self.held_back
        for role, match in self.matches.items():
            rows = model.decorrelate(role, model.residuals(role, self.x, match), match)
            sigma = rows.sigma * estimate.scatter
            beyond = np.maximum(np.abs(rows.values) / sigma - HUBER, 0.0)
            absent = model.records[role].due.absent[match >= 0]
            density = log_density(rows.values, sigma, rows.speed, absent)
            total += float(np.sum(density + 0.5 * beyond**2))
        y = model.unknowns.pull(self.x)
        total -= 0.5 * float(y @ y) + float(np.linalg.slogdet(estimate.root)[1])
        return total if math.isfinite(total) else -math.inf

    @property
    def held_back(self) -> float:
        """Log of twice the posterior probability of κ > 0, as drag cannot be negative."""
        at = self.model.unknowns["drag"].start
        if not self.estimate.sd[at]:
            return 0.0
        below = -self.model.kappa(self.x) / float(self.estimate.own_u[at]) / math.sqrt(2.0)
        return math.log(math.erfc(min(below, 26.0)))  # beyond which a double has no erfc


def simultaneous(model: DropModel, x: Array) -> float:
    """Return the log prior of the release skew: a Cauchy density as wide as the accepted skew."""
    skew = np.ptp([x[model.unknowns[f"{role} release"]] for role in model.records])
    return -math.log1p(float(skew / model.protocol.accept.release_skew) ** 2)


def settle(model: DropModel, x: Array, matches: Matches | None = None) -> Fit:
    """Fit and match in turn until the matches stay the same, and return the fit.

    Parameters
    ----------
    x
        Unknowns to begin with.
    matches
        Matches to begin with; those at `x` if not given.
    """
    matches = match(model, x) if matches is None else matches
    for _ in range(_ROUNDS):
        used, estimate = matches, adjust(model, matches, x)
        x = estimate.x
        matches = without_strays(model, x, match(model, x))
        if all(np.array_equal(used[role], matches[role]) for role in used):
            break
    return Fit(model, used, x, estimate)


def alone(drop: DropFit) -> Fit:
    """Fit a drop by itself from its present unknowns, with the same matches."""
    estimate = adjust(drop.model, drop.matches, drop.x.copy())
    return Fit(drop.model, drop.matches, estimate.x, estimate)


def match(model: DropModel, x: Array) -> Matches:
    """Match all edges to rods, given the unknowns.

    An edge may be late because its rod has struck before it passes, by the scatter of such edges,
    but at most by a part of the rods' spacing.
    """
    matches: Matches = {}
    for role, pairing in model.pairings.items():
        times = model.records[role].edges.times * model.rate(x)
        heights, speeds = model.trajectory(role, x).heights(times)
        landed = model.components.landed * model.expected[role].landed_bare
        sd = np.hypot(_FINE, np.minimum(landed, model.records[role].pitch / PART))
        matches[role] = pairing.match(model.all_levels(role, x), heights, speeds, sd)
    return matches


def without_strays(model: DropModel, x: Array, matches: Matches) -> Matches:
    """Return matches without those far off the fitted motion, such as a bounce for a missed edge.

    Strays enlarge the scatter, so the limit is relative to the median, which is robust.
    """
    kept: Matches = {}
    for role, side in matches.items():
        rows = model.residuals(role, x, side)
        far = np.abs(rows.values) / rows.sigma
        usual = max(1.0, float(np.median(far)) / _MEDIAN) if far.size else 1.0
        kept[role] = side.copy()
        kept[role][matched(side)[0][far > STRAY * usual]] = -1
    return kept
