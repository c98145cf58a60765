"""Advice what to measure better: the inputs with the largest share of a mean's uncertainty."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

from rig.analysis.budget_lines import BUDGET
from rig.analysis.summary import Incline
from rig.measurands import Measurand, averaged
from rig.plain_data import Record

_BETTER = 10.0
"""Assumed improvement of an input's uncertainty, a factor."""
_NAMED = 2
"""Number of inputs named, the most effective first."""
_WORTH = 0.9
"""Largest ratio of new to present U at which an improvement is worth naming."""


@dataclass(frozen=True, slots=True)
class Improvement(Record):
    """Effect of a better input on the means of a quantity.

    Attributes
    ----------
    measurand
        The quantity.
    line
        Line of the budget.
    now, then
        Root mean square of U95 over inclines, and its upper bound with the better input, SI.
    """

    MEMBERS = "quantity=measurand.name measure=line times_better U95=now U95_at_most=then"

    measurand: Measurand
    line: str
    now: float
    then: float
    times_better: float = _BETTER

    @property
    def sentence(self) -> str:
        """The improvement in words."""
        row, present = self.measurand, self.now * self.measurand.fine_scale
        then, digits = self.then * row.fine_scale, max(0, 1 - math.floor(math.log10(present)))
        return (
            f"If {BUDGET[self.line].known} were known {_BETTER:g} times better, U of {row.label} "
            f"would be at most {then:.{digits}f} {row.fine} instead of {present:.{digits}f}."
        )


def improvements(summary: Sequence[Incline]) -> Iterator[Improvement]:
    """Yield the worthwhile improvements of each quantity, the most effective first.

    A variance is a concave function of a prior's variance, and a line of the budget is its slope:
    without that line, the variance is at most the sum of the others. The degrees of freedom are a
    lower bound, as if the remaining lines had them all.
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
    """Return U95 of a mean with one budget line `_BETTER` times smaller."""
    mean, part = line.means[name], line.causes[name].get(cause, 0.0)
    rest = mean.u**2 - (1.0 - _BETTER**-2) * min(part, mean.budget["common"]) ** 2
    return replace(mean, u=math.sqrt(rest), degrees=mean.degrees * (rest / mean.u**2) ** 2).expanded


def _size(values: Iterable[float]) -> float:
    return math.sqrt(fmean(value**2 for value in values))
