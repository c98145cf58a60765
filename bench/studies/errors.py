"""Errors of one quantity against the truth, and how well they keep to what was stated of them."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field
from statistics import fmean, median, stdev
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.result import Measured

_INTENDED = 0.95  # share of the truths that intervals are made to hold


@dataclass(slots=True)
class Errors:
    """Errors of one quantity: measured less true, with the uncertainties and the number of the rig.

    An instrument that states no uncertainty has errors alone.
    """

    errors: list[float] = field(default_factory=list)
    expanded: list[float] = field(default_factory=list)
    standard: list[float] = field(default_factory=list)
    rigs: list[int] = field(default_factory=list)

    def add(self, measured: Measured, true: float, rig: int) -> None:
        """Count a measurement on a rig."""
        self.errors.append(measured.value - true)
        self.expanded.append(measured.expanded)
        self.standard.append(measured.u)
        self.rigs.append(rig)

    @property
    def rms(self) -> float:
        """Root of the mean squared error."""
        return math.sqrt(fmean(error**2 for error in self.errors))

    def sizes(self) -> dict[str, float]:
        """Rms and median size."""
        return {"rms": self.rms, "median": median(map(abs, self.errors))}

    def json(self) -> dict[str, float | int]:
        """Rms, bias, largest error, mean and median U95, and share of intervals with the truth.

        Drops on one rig share errors: ``bias_se`` and ``coverage_se``, from rig to rig, say how
        well bias and coverage are known. ``bias_over_U`` is the bias in units of the mean U95, and
        ``times_u`` the rms over that of the stated standard uncertainties.
        """
        hits = [abs(error) <= u for error, u in zip(self.errors, self.expanded, strict=True)]
        bias, mean_u = fmean(self.errors), fmean(self.expanded)
        figures = {
            "n": len(self.errors),
            "rms": self.rms,
            "bias": bias,
            "worst": max(map(abs, self.errors)),
            "mean_U95": mean_u,
            "median_U95": median(self.expanded),
            "bias_over_U": bias / mean_u,
            "coverage": fmean(hits),
            "times_u": self.rms / math.sqrt(fmean(u**2 for u in self.standard)),
        }
        if len(set(self.rigs)) > 1:
            figures["bias_se"] = self._between(self.errors)
            # Few misses tell little of how they scatter: so many independent errors there are.
            independent = (figures["rms"] / figures["bias_se"]) ** 2
            chance = math.sqrt(_INTENDED * (1.0 - _INTENDED) / independent)
            figures["coverage_se"] = max(self._between(hits), chance)
        return figures

    def _between(self, values: Sequence[float]) -> float:
        """Standard error of a mean over rigs."""
        by_rig: dict[int, list[float]] = defaultdict(list)
        for rig, value in zip(self.rigs, values, strict=True):
            by_rig[rig].append(value)
        means = [fmean(group) for group in by_rig.values()]
        return stdev(means) / math.sqrt(len(means))


def shares_held(figures: Mapping[str, float], digits: int) -> tuple[str, str]:
    """Write the share of intervals with the truth, and how well it is known (± from rig to rig)."""
    chance = f"± {figures['coverage_se']:.{digits}%}" if "coverage_se" in figures else ""
    return f"{figures['coverage']:.{digits}%}", chance
