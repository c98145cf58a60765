"""Least squares with prior knowledge, and the uncertainties that follow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.equations import Linearization, linearize, scaled
from rig.analysis.square_root import EquationRows, Root, square_root

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Matches = Mapping[str, Sequence[Index]]

STEPS = 60
"""Of an adjustment, which a good one never needs."""
DONE = 1e-3
"""Of a standard uncertainty: a step so short is the last, for the next one is shorter again."""
PATIENT = 6
"""Steps after which one back is no part of finding the way: an edge at the very moment of an impact
has a slope on either side, and steps go to and fro over the best place, which lies between them."""
_DAMPED = 1e-3  # λ of Levenberg and Marquardt with which shorter steps begin
_FAINT = 1e-12  # λ that does nothing in a double's digits
_FASTER = 10.0  # by which λ grows with each step taken back
_SLOWER = 3.0  # and shrinks with each other one
_FORGOTTEN = 0.5  # of a column's length, with each step: by these lengths steps are measured
_GAIN = 0.25  # of what the slopes promise, which a step has to bring
_TRIED = 0.01  # of a step, after which its bend is looked at
_BENT = 0.75  # of a step's length: what bends more is shortened
_UNSEEN = 1.0  # standard uncertainties: where a longer step leads is looked at
_STEADY = 0.01  # relative change of chi2 below which it tells the scatter of the edges
_MORE = 1.05  # times as much scatter as assumed, below which edges are weighed as they were
_NO_ROOT = Root(np.zeros((0, 0)), np.zeros(0))


@dataclass(frozen=True)
class Estimate:
    """Unknowns after adjustment.

    Attributes
    ----------
    x, sd
        Best estimates (deviations from nominal) and prior uncertainties, shape ``(unknowns,)``.
    root
        R of the information RᵀR in units of the prior uncertainties, prior included.
    chi2, edges
        Weighted sum of squares of the edges, and their number.
    scatter
        How much more the edges scatter than assumed; at least 1, and already allowed for.
    settled
        Whether the steps came to an end.
    rows
        What the edges leave over, and its slopes, of each side.
    """

    x: Array
    sd: Array
    root: Array
    chi2: float
    edges: int
    scatter: float
    settled: bool = True
    rows: Mapping[str, EquationRows] = field(default_factory=dict, repr=False)

    @cached_property
    def inverse(self) -> Array:
        """R⁻¹."""
        return np.linalg.inv(self.root).astype(float, copy=False)

    @cached_property
    def covariance(self) -> Array:
        """R⁻¹R⁻ᵀ, in units of the prior uncertainties."""
        return self.inverse @ self.inverse.T

    def u(self, gradient: Array) -> float:
        """Return the standard uncertainty of a function with these derivatives."""
        return float(np.linalg.norm((gradient * self.sd) @ self.inverse))

    def beyond(self, x: Array) -> float:
        """How far this is from other unknowns, see `length`."""
        return length(scaled(self.x - x, self.sd), self.root)

    @cached_property
    def degrees(self) -> float:
        """Degrees of freedom: edges less the unknowns that they determine."""
        return self.edges - self.x.size + float(np.sum(self.inverse**2))

    def kept(self) -> Estimate:
        """Return the same in little memory."""
        rows = {role: one.triangle() for role, one in self.rows.items()}
        return replace(self, rows=rows)


def adjust(
    model: DropModel,
    matches: Matches,
    x: Array,
    centre: Array | None = None,
    done: float = DONE,
    *,
    rough: bool = False,
) -> Estimate:
    """Find the unknowns that fit all matched edges best.

    Gauss–Newton on ‖r/σ‖² + ‖(x − centre)/sd‖²; residuals beyond 4 σ weigh less (Huber).

    Parameters
    ----------
    matches
        For each side what `rig.analysis.annealing.Pairing.matched` returned.
    x
        Where to begin.
    centre
        Prior means of the unknowns, zero if not given.
    done
        How short a step is the last, see `length`.
    rough
        Whether only the way matters, and edges are weighed as they were.
    """

    def about(at: Array, inflation: float) -> Linearization:
        return linearize(model, matches, at, inflation)

    sd = model.unknowns.sd
    return least_squares(about, sd, x, centre, done, rough=rough)


@np.errstate(all="ignore")  # a step may lead to where there is no number, and is taken back
def least_squares(
    linearize: Callable[[Array, float], Linearization],
    sd: Array,
    x: Array,
    centre: Array | None = None,
    done: float = DONE,
    steps: int = STEPS,
    *,
    rough: bool = False,
) -> Estimate:
    """Find the unknowns that fit any observations best, given what is known of them beforehand.

    Steps of Gauss and Newton. One that leads where the observations fit worse, or to no number, is
    taken back, and shorter ones are tried (Levenberg and Marquardt).

    Parameters
    ----------
    linearize
        Observations about a point, if they scatter so many times as assumed.
    sd
        Prior standard uncertainties of the unknowns; where 0 the unknown stays as it is.
    x, centre, done, steps, rough
        As in `adjust`.

    Returns
    -------
    Estimate
        Always of finite numbers; where no further step could be taken it is not settled.
    """
    y = scaled(x, sd)
    prior = np.zeros_like(x) if centre is None else scaled(centre, sd)
    search = _Search(linearize, sd, prior)
    here: _Point | None = None
    limit = math.inf
    share, damping, moved = 1.0, 0.0, 0.0
    settled, ahead = False, np.zeros_like(y)
    for step in range(steps):
        point = search.rooted(search.look(y), limit)
        if not math.isfinite(point.size):
            if here is None:
                break
            share, damping = 1.0, damping * _FASTER or _DAMPED
            y, limit = search.onward(here, damping)
            continue
        before, here = here, point
        turned, damping = ahead, damping / _SLOWER if damping > _FAINT else 0.0
        y, _ = search.onward(here, damping)
        ahead = y - here.y
        # Steps to and fro that get shorter end by themselves, and sooner.
        if step > PATIENT and not damping and here.root.turns_back(ahead, turned):
            share *= 0.5
        y = here.y + share * ahead
        limit = search.limit(here, share * ahead)
        last, moved = moved, share * here.size
        whole = share == 1.0 and not damping
        short = moved < done or (whole and moved**2 < done * last)
        # While the unknowns still move, χ² is large for that, and says nothing of the scatter.
        # Unknowns take away less than their number: a chi2 so small needs no closer look.
        seen = here.seen
        previous = 0.0 if before is None else before.seen.chi2
        calm = seen.chi2 <= seen.size - x.size or (
            bool(step) and abs(seen.chi2 - previous) <= _STEADY * max(seen.chi2, 1.0)
        )
        if not (short if rough else calm):
            continue
        factor = search.scatter(here)
        if short and (rough or factor == 1.0):
            settled = True
            search.inflation *= factor
            break
        if factor != 1.0 and here.size <= factor:
            # They scatter more or less than assumed: weigh them so, once more from here.
            search.weigh(factor)
            y, limit, ahead, moved = here.y, math.inf, turned, 0.0
    return (
        search.estimate(here, y, limit, settled=settled)
        if here
        else Estimate(x, sd, np.eye(x.size), math.inf, 0, 1.0, settled=False)
    )


class _Point(NamedTuple):
    """Where a search is.

    Attributes
    ----------
    y, seen
        Unknowns in units of their prior uncertainties, and what was linearized there.
    loss
        What a step has to make less, priors included.
    root, size
        Of the information, and how long the step of Gauss and Newton is; no number where there is
        no such step.
    """

    y: Array
    seen: Linearization
    loss: float
    root: Root
    size: float = math.nan


class _Search:
    """Observations and priors, and how to go on from a point.

    Parameters
    ----------
    linearize, sd
        As in `least_squares`.
    prior
        Prior means of the unknowns, in units of `sd`.
    """

    def __init__(
        self,
        linearize: Callable[[Array, float], Linearization],
        sd: Array,
        prior: Array,
    ) -> None:
        self._linearize, self._sd, self._prior = linearize, sd, prior
        self.inflation = 1.0
        self._steepest = np.zeros_like(sd)  # lengths of the root's columns, the largest lately

    def look(self, y: Array) -> _Point:
        """Look what observations say about a point."""
        seen, off = self._linearize(y * self._sd, self.inflation), y - self._prior
        return _Point(y, seen, seen.loss + float(off @ off), _NO_ROOT)

    def rooted(self, point: _Point, limit: float) -> _Point:
        """Reduce observations and priors where the loss is within a limit."""
        if not point.loss <= limit:
            return point
        root = square_root([*point.seen.rows.values()], self._sd, point.y - self._prior)
        return point._replace(root=root, size=float(np.linalg.norm(root.left)))

    def onward(self, here: _Point, damping: float) -> tuple[Array, float]:
        """Return where a step leads, and what the loss may be there."""
        lengths = np.linalg.norm(here.root.matrix, axis=0)
        self._steepest = np.maximum(_FORGOTTEN * self._steepest, lengths)
        step = self._bent(here, damping) if damping else here.root.step()
        return here.y + step, self.limit(here, step)

    def _bent(self, here: _Point, damping: float) -> Array:
        """Step along a curve, by the second derivative along it (Transtrum and Sethna 2012)."""
        root = here.root.damped(damping, self._steepest)
        straight = root.step()
        there, gradient = self.look(here.y + _TRIED * straight).seen, np.zeros_like(here.y)
        for role, rows in here.seen.rows.items():
            turn = there.rows[role].slopes - rows.slopes
            turned = turn @ (straight * self._sd)[rows.columns]
            gradient[rows.columns] += self._sd[rows.columns] * (turned @ rows.slopes)
        bend = root.pulled(0.5 / _TRIED * gradient)
        long = np.linalg.norm(self._steepest * straight)
        short = 2.0 * np.linalg.norm(self._steepest * bend) <= _BENT * long
        return straight + bend if short else straight * math.nan

    def limit(self, here: _Point, step: Array) -> float:
        """What the loss may be after a step: mostly it has to become less, see `_GAIN`.

        A step to and fro about the best place may make it a little more, for slopes are not quite
        its.
        """
        left, usual = here.root.left + here.root.matrix @ step, _usual(here.seen)
        if here.size**2 < usual:
            return here.loss + usual
        return here.loss - _GAIN * (here.size**2 - float(left @ left))

    def scatter(self, here: _Point) -> float:
        """How many times as much as thought observations scatter; 1 where that is near enough.

        They never scatter less than stated.
        """
        seen, root = here.seen, here.root.matrix
        free = seen.size - len(root)
        # No unknown is left open by less than if all others were known.
        least = free + float(np.sum(1.0 / np.sum(root**2, axis=0)))
        if self.inflation == 1.0 and seen.chi2 < _MORE**2 * max(least, 1.0):
            return 1.0
        degrees = free + float(np.sum(np.linalg.inv(root) ** 2))
        factor = max(math.sqrt(seen.chi2 / max(degrees, 1.0)), 1.0 / self.inflation)
        return 1.0 if 1.0 / _MORE < factor < _MORE else factor

    def weigh(self, factor: float) -> None:
        """Weigh observations as if they scattered so many times as before."""
        self.inflation *= factor
        self._steepest = self._steepest / factor

    def estimate(self, here: _Point, y: Array, limit: float, *, settled: bool) -> Estimate:
        """Sum up a search that was last at a point, and has another one in mind.

        That one is looked at where it is far, or was not reached from a better one.
        """
        far = length(y - here.y, here.root.matrix)
        if not far <= _UNSEEN and not self.look(y).loss <= limit:
            y, settled = here.y, False
        moved = (y - here.y) * self._sd
        return Estimate(
            y * self._sd,
            self._sd,
            here.root.matrix,
            here.seen.chi2,
            here.seen.size,
            self.inflation,
            settled,
            {role: rows.after(moved) for role, rows in here.seen.rows.items()},
        )


def _usual(seen: Linearization) -> float:
    """What an observation adds to χ²: 1, or more where they scatter more than assumed."""
    return max(1.0, seen.chi2 / max(1, seen.size))


def length(step: Array, root: Array) -> float:
    """|R·d|: no function of the unknowns moves by more of its own standard uncertainties.

    Parameters
    ----------
    step
        Of the unknowns, in units of their prior uncertainties.
    root
        As in `Estimate`.
    """
    return float(np.linalg.norm(root @ step))
