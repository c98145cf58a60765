"""Least squares with prior knowledge, and the uncertainties that follow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.equations import Linearization, linearize, scaled
from rig.analysis.square_root import square_root

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.analysis.drop_model import DropModel
    from rig.analysis.square_root import EquationRows, Root
    from rig.arrays import Array, Index

    Matches = Mapping[str, Sequence[Index]]

STEPS = 60
"""Of an adjustment, which a good one never needs."""
DONE = 1e-3
"""Of a standard uncertainty: a step so short is the last, for the next one is shorter again."""
PATIENT = 4
"""Short steps in a row that are no part of finding the way any more: an edge at the very moment of
an impact has a slope on either side, and the best place lies between them."""
_DAMPED = 1e-3  # λ of Levenberg and Marquardt with which shorter steps begin
_FAINT = 1e-12  # λ that does nothing in a double's digits
_FASTER = 10.0  # by which λ grows with each step taken back
_SLOWER = 3.0  # and shrinks with each other one
_FORGOTTEN = 0.5  # of a column's length, with each step: by these lengths steps are measured
_GAIN = 0.25  # of what the slopes promise, which a step has to bring
_TRIED = 0.01  # of a step, after which its bend is looked at
_BENT = 0.75  # of a step's length: what bends more is shortened
_MORE = 1.05  # times as much scatter as assumed, below which edges are weighed as they were


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
    def own_u(self) -> Array:
        """Standard uncertainty of each unknown."""
        return np.asarray(np.linalg.norm(self.inverse, axis=1) * self.sd)

    def u(self, gradient: Array) -> float:
        """Return the standard uncertainty of a function with these derivatives."""
        return float(np.linalg.norm((gradient * self.sd) @ self.inverse))

    @cached_property
    def degrees(self) -> float:
        """Degrees of freedom: edges less the unknowns that they determine."""
        return self.edges - self.x.size + float(np.sum(self.inverse**2))


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
    search = _Search(linearize, sd, np.zeros_like(x) if centre is None else scaled(centre, sd))
    point = search.look(scaled(x, sd))
    if not math.isfinite(point.loss):
        return Estimate(x, sd, np.eye(x.size), math.inf, 0, 1.0, settled=False)
    damping, previous, step = 0.0, 0.0, np.zeros_like(x)
    settled, shorts = False, 0
    for _ in range(steps):
        step = search.step(point, damping)
        moved = length(step, point.root.matrix)
        near = point.size < point.usual
        # As long as steps get shorter alike, the next one is that of the last times their ratio.
        shorts = shorts + 1 if moved < done else 0
        last = point.size < done or shorts > PATIENT
        short = near and (last or (not damping and moved**2 < done * previous))
        if short or (near and not rough):
            factor = search.scatter(point)
            if short and (rough or factor == 1.0):
                search.inflation, settled = search.inflation * factor, True
                break
            if factor != 1.0:
                point, previous = search.weigh(point, factor), 0.0
                continue
        ahead = search.look(point.y + step)
        if not ahead.loss <= point.loss - _GAIN * point.promised(step):
            damping = damping * _FASTER or _DAMPED
            continue
        point, previous = ahead, moved
        damping = damping / _SLOWER if damping > _FAINT else 0.0
    step = step if settled else np.zeros_like(x)
    rows = {role: rows.after(step * sd) for role, rows in point.seen.rows.items()}
    return Estimate(
        (point.y + step) * sd,
        sd,
        point.root.matrix,
        point.seen.chi2,
        point.seen.size,
        search.inflation,
        settled,
        rows,
    )


@dataclass(frozen=True)
class _Point:
    """Where a search is.

    Attributes
    ----------
    y, seen
        Unknowns in units of their prior uncertainties, and what was linearized there.
    sd, pull
        These uncertainties, and how far the unknowns are above their prior means, in these units.
    """

    y: Array
    seen: Linearization
    sd: Array
    pull: Array

    @property
    def loss(self) -> float:
        """What a step has to make less, priors included."""
        return self.seen.loss + float(self.pull @ self.pull)

    @property
    def usual(self) -> float:
        """How many times as much as assumed observations scatter, if they fit as well as can be."""
        return math.sqrt(max(1.0, self.seen.chi2 / max(1, self.seen.size)))

    @cached_property
    def root(self) -> Root:
        """Observations and priors, reduced to a square root."""
        return square_root([*self.seen.rows.values()], self.sd, self.pull)

    @property
    def size(self) -> float:
        """How long the step of Gauss and Newton is, see `length`."""
        return float(np.linalg.norm(self.root.left))

    def promised(self, step: Array) -> float:
        """By how much a step makes the loss less, if slopes were the same everywhere."""
        remainder = self.root.left + self.root.matrix @ step
        return float(self.root.left @ self.root.left - remainder @ remainder)


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
        self, linearize: Callable[[Array, float], Linearization], sd: Array, prior: Array
    ) -> None:
        self._linearize, self._sd, self._prior = linearize, sd, prior
        self.inflation = 1.0
        self._steepest = np.zeros_like(sd)  # lengths of the root's columns, the largest lately

    def look(self, y: Array) -> _Point:
        """Look what observations say about a point."""
        return _Point(y, self._linearize(y * self._sd, self.inflation), self._sd, y - self._prior)

    def step(self, point: _Point, damping: float) -> Array:
        """Step downhill; the more it is damped, the shorter (Marquardt 1963).

        By its second derivative along the way it follows a curve (Transtrum and Sethna 2012).
        """
        lengths = np.linalg.norm(point.root.matrix, axis=0)
        self._steepest = np.maximum(_FORGOTTEN * self._steepest, lengths)
        if not damping:
            return point.root.step()
        root = point.root.damped(damping, self._steepest)
        straight = root.step()
        ahead, gradient = self.look(point.y + _TRIED * straight).seen, np.zeros_like(point.y)
        for role, rows in point.seen.rows.items():
            turn = ahead.rows[role].slopes - rows.slopes
            turned = turn @ (straight * self._sd)[rows.columns]
            gradient[rows.columns] += self._sd[rows.columns] * (turned @ rows.slopes)
        bend = root.pulled(0.5 / _TRIED * gradient)
        long = np.linalg.norm(self._steepest * straight)
        short = 2.0 * np.linalg.norm(self._steepest * bend) <= _BENT * long
        return straight + bend if short else straight * math.nan

    def scatter(self, point: _Point) -> float:
        """How many times as much as thought observations scatter; 1 where that is near enough.

        They never scatter less than stated.
        """
        seen, inverse = point.seen, np.linalg.inv(point.root.matrix)
        degrees = max(1.0, seen.size - len(inverse) + float(np.sum(inverse**2)))
        factor = max(math.sqrt(seen.chi2 / degrees), 1.0 / self.inflation)
        return 1.0 if 1.0 / _MORE < factor < _MORE else factor

    def weigh(self, point: _Point, factor: float) -> _Point:
        """Look at a point as if observations scattered so many times as before."""
        self.inflation *= factor
        self._steepest = self._steepest / factor
        return self.look(point.y)


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
