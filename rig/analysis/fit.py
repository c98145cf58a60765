"""One drop matched and adjusted by itself, ready to be judged, or to be fitted with others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.adjust import Estimate, adjust
from rig.analysis.annealing import split
from rig.analysis.equations import STRAY

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.annealing import Guess
    from rig.analysis.drop_model import DropModel
    from rig.arrays import Array, Index

    Matches = dict[str, list[Index]]

CLOSE = 0.05
"""Of a standard uncertainty: after a step so short a drop's readings are weighed, for that is near
enough by its square."""
_FINE = 0.8e-3  # m: how far off an adjusted trajectory may, one standard deviation
_NEAR = 10.0  # standard uncertainties: after a step so short all edges can be matched again
_ROUNDS = 6
_MEDIANS = 2.2
"""1/0.6745 standard deviations, by half as much more as few edges may happen to scatter."""


def count_matched(side: Sequence[Index]) -> int:
    """Count the edges of a side that belong to a rod."""
    return int(np.count_nonzero(np.concatenate(side) >= 0))


@dataclass(frozen=True, slots=True)
class Matched:
    """A drop's unknowns, and which edge is which rod.

    Attributes
    ----------
    x
        The unknowns, as they were adjusted; shape ``(unknowns,)``.
    """

    model: DropModel
    matches: Matches
    x: Array

    @property
    def matched(self) -> int:
        """Number of edges that belong to a rod."""
        return sum(map(count_matched, self.matches.values()))

    @property
    def rods(self) -> dict[int, int]:
        """Rod of every matched edge of the drop."""
        return {
            edge: rod
            for role, record in self.model.records.items()
            for train, match in zip(record.trains, self.matches[role], strict=True)
            for edge, rod in zip(
                train.edge[match[match >= 0]].tolist(), train.rods[match >= 0].tolist(), strict=True
            )
        }


@dataclass(frozen=True, slots=True)
class Fit(Matched):
    """A drop adjusted by itself."""

    estimate: Estimate


def settle(model: DropModel, matches: Matches | None = None, x: Array | None = None) -> Fit:
    """Match and adjust in turn until that moves the chain no more, to a part of its uncertainty.

    Parameters
    ----------
    matches
        To begin with; `None` where nothing is matched yet.
    x
        Unknowns to begin with, if not as the guesses have them.
    """
    x = model.first() if x is None else x
    matches = match(model, x) if matches is None else matches
    # Not to the end where the matches are about to change.
    estimate = adjust(model, matches, x, done=_NEAR, rough=True)
    for _ in range(_ROUNDS):
        again = without_strays(model, estimate.x, match(model, estimate.x), estimate.scatter)
        alike = all(
            np.array_equal(np.concatenate(side), np.concatenate(again[role]))
            for role, side in matches.items()
        )
        matches = matches if alike else again  # what was made for the same is at hand
        estimate = adjust(model, matches, estimate.x, done=CLOSE)
        if alike:
            break
    return Fit(model, matches, estimate.x, estimate)


class Begun(NamedTuple):
    """A drop adjusted at some time scale: all that is needed to adjust it at another."""

    guesses: Mapping[str, Guess]
    matches: Matches
    x: Array


def timed(model: DropModel, begun: Begun, rate: float) -> Fit:
    """Adjust once more at a time scale that is near by, each edge staying the rod it is.

    Parameters
    ----------
    model
        At that time scale, with the guesses of `begun`.
    rate
        Ticks in a second by it, over those by the other one.
    """
    x, clock = begun.x.copy(), model.unknowns["clock"]
    x[clock] = (1.0 + x[clock]) * rate - 1.0
    return alone(Matched(model, begun.matches, x))


def alone(drop: Matched) -> Fit:
    """Adjust a drop by itself from where it is, each edge staying the rod it is."""
    estimate = adjust(drop.model, drop.matches, drop.x.copy(), done=CLOSE)
    return Fit(drop.model, drop.matches, estimate.x, estimate)


def match(model: DropModel, x: Array) -> Matches:
    """Match all edges to rods, given where the chains are."""
    matches: Matches = {}
    for role, pairing in model.pairings.items():
        heights, speeds = model.trajectory(role, x).heights(pairing.times * model.rate(x))
        matches[role] = pairing.matched(model.all_levels(role, x), heights, speeds, _FINE)
    return matches


def without_strays(model: DropModel, x: Array, matches: Matches, scatter: float = 1.0) -> Matches:
    """Take back matches far off the adjusted motion: a bounce where a rod's edge was missed.

    Parameters
    ----------
    scatter
        How much more the edges scatter than the model assumes.
    """
    return {role: _kept(model, role, x, side, scatter) for role, side in matches.items()}


def _kept(model: DropModel, role: str, x: Array, side: list[Index], scatter: float) -> list[Index]:
    rows = model.residuals(role, x, side)
    far = np.abs(rows.values) / rows.sigma
    # A few strays enlarge the scatter, and would hide behind it: most edges tell how much it is.
    usual = max(1.0, _MEDIANS * float(np.sort(far)[far.size // 2])) if far.size else 1.0
    limit = STRAY * min(scatter, usual)
    stray = far > limit
    # Of a rod's two sides that do not go together one is wrong, or both: the one that is further
    # off, and the other if it is far off too.
    parted = model.parted(role, rows, side)
    second = np.flatnonzero(np.abs(parted.values) > limit * parted.sigma)
    second = second[parted.sigma[second] < rows.sigma[second]]
    stray[second - (far[second - 1] > far[second])] = True
    for either in (second, second - 1):
        stray[either] |= far[either] > 0.5 * limit
    if not stray.any():
        return side
    line = np.concatenate(side)
    line[np.flatnonzero(line >= 0)[stray]] = -1
    return split(line, model.pairings[role].ends)
