"""Propagation of distributions through the adjustment of one drop (JCGM 101)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.adjust import adjust
from rig.analysis.quantities import measurands
from rig.analysis.unknowns import ANYTHING

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.analysis.fit import Fit

    Array = NDArray[np.float64]

PROBABILITY = 0.95


@dataclass(frozen=True, slots=True)
class Propagated:
    """What became of one quantity.

    Attributes
    ----------
    mean, u
        Mean and standard deviation of all trials.
    low, high
        Ends of the probabilistically symmetric 95 % interval (JCGM 101, 7.7).
    """

    mean: float
    u: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Array) -> Propagated:
        """Sum up the trials, shape ``(trials,)``."""
        tail = 0.5 * (1.0 - PROBABILITY)
        low, high = np.quantile(values, [tail, 1.0 - tail])
        return cls(float(values.mean()), float(values.std(ddof=1)), float(low), float(high))

    def json(self) -> dict[str, float]:
        """``{"mean", "u", "low", "high"}``."""
        return {name: getattr(self, name) for name in self.__slots__}


def monte_carlo(fit: Fit, trials: int, seed: int) -> dict[str, Propagated]:
    """Draw everything that is uncertain, and adjust again each time, with nothing linearised.

    Each trial moves every edge by its own scatter and every stated value by its standard
    uncertainty; of what is not known at all there is nothing to draw.

    Parameters
    ----------
    fit
        A drop adjusted by itself.
    trials
        M of JCGM 101, at least 2.
    seed
        Of the generator; the same seed gives the same trials.
    """
    rng = np.random.default_rng(seed)
    model, at = fit.model, fit.estimate.x
    sd = model.unknowns.sd
    stated = np.where(sd < ANYTHING, sd, 0.0)
    shifts = {role: _scatter(fit, role) * fit.estimate.scatter for role in model.sides}
    found: dict[str, list[float]] = {}
    for _ in range(trials):
        shaken = model.shaken(
            {role: shift * rng.normal(size=shift.size) for role, shift in shifts.items()}
        )
        estimate = adjust(shaken, fit.matches, at, stated * rng.normal(size=sd.size))
        for name, (value, _gradient) in measurands(shaken, estimate.x).items():
            found.setdefault(name, []).append(value)
    return {name: Propagated.of(np.array(values)) for name, values in found.items()}


def _scatter(fit: Fit, role: str) -> Array:
    """Standard deviation of every observed edge of a side in time, s; 0 where it is not matched."""
    matches = fit.matches[role]
    rows = fit.model.equations(role, fit.estimate.x, matches)
    expected = fit.model.expected[role]
    _, edges = expected.chosen(matches)
    found = np.zeros(expected.times.size)
    found[edges] = rows.sigma / rows.speed
    return found
