"""A rate that may wander, from readings of the phase: a straight line where nothing says more.

The rate is a constant and a random walk about it; the phase, its integral, is read with noise. For
a given size of the walk the best estimate is linear (a smoothing spline: Wahba 1978, J. R. Stat.
Soc. B 40, 364) and its variance exact. The size itself is the most likely one (REML), and as
small as a steady clock's unless the readings speak clearly against that.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Array, Index

STEADY = 5e-6 / 60.0
"""Walk of a rate nobody saw wander, relative per √s: 5 ppm in an hour, a steady room."""
_FACTORS = 2.0 ** np.arange(-3.0, 14.0)  # sizes tried, where readings scatter as expected
_CLEAR = 2.0  # gain in log likelihood that speaks clearly: by chance, in less than 1 of 40
_PRIOR = 2.0  # weight of the expected scatter, in readings, so that few readings stay honest
_ROUNDS = 3  # the walk is known in the readings' units once their scatter is
_POINTS = 300
_LEAST = 4  # points an epoch keeps at least: fewer would lose its slope


class Readings(NamedTuple):
    """Phases of a clock.

    Attributes
    ----------
    at
        When, s.
    phase
        Clock less nominal, s; each epoch has an offset of its own.
    sigma
        Expected scatter, s.
    epoch
        Number of the epoch, from 0, each one used.
    """

    at: Array
    phase: Array
    sigma: Array
    epoch: Index

    def only(self, which: NDArray[np.bool_]) -> "Readings":
        """Choose some; epochs left with fewer than two say nothing and are left out."""
        counts = np.bincount(self.epoch[which], minlength=int(self.epoch.max(initial=-1)) + 1)
        which = which & (counts[self.epoch] >= 2)
        _, number = np.unique(self.epoch[which], return_inverse=True)
        return Readings(self.at[which], self.phase[which], self.sigma[which], number)


class Track:
    """The course of a clock's rate.

    Parameters
    ----------
    readings
        At least two in each epoch, in order of time. Until `search` is called, the rate is taken
        to wander no more than a steady one.

    Attributes
    ----------
    seen
        Whether the readings show it.
    """

    def __init__(self, readings: Readings) -> None:
        points = _condense(readings)
        self.begin = float(readings.at[0])
        self.span = float(readings.at[-1]) - self.begin
        self._x = x = (points.at - self.begin) / self.span
        self._sigma = points.sigma
        n, epochs = points.at.size, int(points.epoch[-1]) + 1
        design = np.zeros((n, epochs + 1))
        design[np.arange(n), points.epoch] = 1.0
        design[:, -1] = x
        low, high = np.minimum.outer(x, x), np.maximum.outer(x, x)
        self._kernel = low**2 * (3.0 * high - low) / 6.0  # of ∫ random walk
        # In these coordinates noise and walk are both diagonal, for every size of the walk.
        values, self._turn = np.linalg.eigh(self._kernel / np.outer(points.sigma, points.sigma))
        self._values = np.maximum(values, 0.0)
        self._design = self._turn.T @ (design / points.sigma[:, None])
        self._phase = self._turn.T @ (points.phase / points.sigma)
        self.seen = False
        self._solve(0.0)
        for _ in range(_ROUNDS):
            self._solve(STEADY**2 * self.span**3 / self._scale2)

    def search(self) -> None:
        """Find the size of the walk."""
        if self._x.size - self._beta.size < 3:
            return
        steady, usual = self._ratio, STEADY**2 * self.span**3
        least = self._solve(steady) + _CLEAR
        likelihoods = [self._solve(usual * factor**2) for factor in _FACTORS]
        best = int(np.argmax(likelihoods))
        self._solve(usual * float(_FACTORS[best]) ** 2)
        self.seen = likelihoods[best] > least and self.wander > STEADY
        if not self.seen:
            self._solve(steady)

    @property
    def wander(self) -> float:
        """Size of the random walk in use, relative per √s."""
        return sqrt(self._ratio * self._scale2 / self.span**3)

    def rate(self, at: float) -> tuple[float, float]:
        """Rate less nominal at a moment and its standard uncertainty, both relative.

        Parameters
        ----------
        at
            s, on the axis of the readings; outside of them the walk goes on.
        """
        end = (at - self.begin) / self.span
        shared = np.minimum(self._x, max(0.0, end))  # of the walk, by each reading and the moment
        return self._estimate(shared * self._x - shared**2 / 2.0, abs(end))

    def mean(self) -> tuple[float, float]:
        """Mean rate less nominal from the first reading to the last, and its uncertainty."""
        return self._estimate(self._x**2 * (3.0 - self._x) / 6.0, 1.0 / 3.0)

    def residuals(self, readings: Readings) -> Array:
        """Phases less the estimate, over their expected scatter, for the epochs of the track."""
        x = (readings.at - self.begin) / self.span
        weights = self._turn @ (self._g * self._rest)
        walk = self._ratio * self._kernel @ (weights / self._sigma)
        course = self._beta[-1] * x + np.interp(x, self._x, walk)
        residuals: Array = (readings.phase - self._beta[readings.epoch] - course) / readings.sigma
        return residuals

    def _solve(self, ratio: float) -> float:
        """Solve for one size of the walk and return its log likelihood."""
        self._ratio = ratio
        self._g = g = 1.0 / (1.0 + ratio * self._values)
        information = self._design.T @ (g[:, None] * self._design)
        self._covariance = np.linalg.inv(information)
        self._beta = self._covariance @ (self._design.T @ (g * self._phase))
        self._rest = rest = self._phase - self._design @ self._beta
        degrees = rest.size - self._beta.size + _PRIOR
        self._scale2 = (float(g @ rest**2) + _PRIOR) / degrees
        _, volume = np.linalg.slogdet(information)
        return -0.5 * float(degrees * np.log(self._scale2) - np.log(g).sum() + volume)

    def _estimate(self, with_phase: Array, variance: float) -> tuple[float, float]:
        """Estimate a functional of the walk, given its covariances, beside the constant."""
        c = self._ratio * (self._turn.T @ (with_phase / self._sigma))
        direct = -self._design.T @ (self._g * c)
        direct[-1] += 1.0
        value = float(self._beta[-1] + c @ (self._g * self._rest))
        unseen = self._ratio * variance - float(c @ (self._g * c))
        u2 = self._scale2 * (max(0.0, unseen) + float(direct @ self._covariance @ direct))
        return value / self.span, sqrt(u2) / self.span


def _condense(readings: Readings) -> Readings:
    """Take neighbours in time together, so that the work does not grow with the session."""
    n = readings.at.size
    if n <= _POINTS:
        return readings
    first = np.flatnonzero(np.diff(readings.epoch, prepend=-1))
    begin, end = readings.at[first], readings.at[np.append(first[1:], n) - 1]
    spans = end - begin
    counts = np.maximum(_LEAST, np.round(_POINTS * spans / max(spans.sum(), 1e-300)))
    along = (readings.at - begin[readings.epoch]) / np.maximum(spans, 1e-300)[readings.epoch]
    bins = np.minimum(along * counts[readings.epoch], counts[readings.epoch] - 1.0).astype(np.intp)
    number = np.cumsum(np.diff(readings.epoch * (n + _LEAST) + bins, prepend=-1) != 0) - 1
    weight = readings.sigma**-2.0
    total = np.bincount(number, weight)
    at, phase = (
        np.bincount(number, weight * values) / total for values in (readings.at, readings.phase)
    )
    epoch = readings.epoch[np.flatnonzero(np.diff(number, prepend=-1))]
    return Readings(at, phase, 1.0 / np.sqrt(total), epoch)
