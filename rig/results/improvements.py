"""What to measure next: which stated guess makes most of a mean's uncertainty."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import fmean
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.analysis.quantities import BUDGET
from rig.measurands import averaged

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rig.analysis.summary import Incline
    from rig.measurands import Measurand

_BETTER = 10.0
"""Times as well as stated that something is measured."""
_NAMED = 2
"""Guesses named, the largest first."""
_WORTH = 0.9
"""Share of U to which measuring one must bring it at least."""


class Improvement(NamedTuple):
    """What a better measurement of one thing would do to the means of one quantity.

    Attributes
    ----------
    measurand
        The quantity.
    line
        Of the budget.
    now, then
        Root mean square of U95 over inclines, and what it would be at most, SI.
    """

    measurand: Measurand
    line: str
    now: float
    then: float

    def json(self) -> dict[str, Any]:
        """One member of ``measure_next``."""
        names = {"quantity": self.measurand.name, "measure": self.line, "times_better": _BETTER}
        return names | {"U95": self.now, "U95_at_most": self.then}

    @property
    def sentence(self) -> str:
        """It in words."""
        row, present = self.measurand, self.now * self.measurand.fine_scale
        then, digits = self.then * row.fine_scale, max(0, 1 - math.floor(math.log10(present)))
        return (
            f"If {BUDGET[self.line].known} were known {_BETTER:g} times better, U of {row.label} "
            f"would be at most {then:.{digits}f} {row.fine} instead of {present:.{digits}f}."
        )


def improvements(summary: Sequence[Incline]) -> Iterator[Improvement]:
    """Yield what is worth measuring better, of each quantity the most worthwhile first.

    A variance is a concave function of what a prior leaves open, and a line of the budget is its
    slope: without it the variance is at most what the other lines make. Of the degrees of freedom
    the least is supposed, that what is left has them all.
    """
    for row in averaged():
        lines = [line for line in summary if line.causes.get(row.name)]
        if not lines:
            continue
        present = _size(line.means[row.name].expanded for line in lines)
        then = {
            name: _size(_without(line, row.name, name) for line in lines)
            for name in lines[0].causes[row.name]
            if BUDGET[name].known
        }
        for name in sorted(then, key=lambda name: then[name])[:_NAMED]:
            if then[name] < _WORTH * present:
                yield Improvement(row, name, present, then[name])


def _without(line: Incline, name: str, cause: str) -> float:
    """Return U95 of a mean with one cause so much smaller."""
    mean, part = line.means[name], line.causes[name].get(cause, 0.0)
    rest = mean.u**2 - (1.0 - _BETTER**-2) * min(part, mean.budget["common"]) ** 2
    return replace(mean, u=math.sqrt(rest), degrees=mean.degrees * (rest / mean.u**2) ** 2).expanded


def _size(values: Iterable[float]) -> float:
    return math.sqrt(fmean(value**2 for value in values))
