"""Tables of a session's results, for page and terminal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from rig.analysis.result import COUNTS, Measured
from rig.measurands import Measurand, acceleration_in, averaged
from rig.reasons import remedies, sentences
from rig.report.columns import Part, table_parts
from rig.report.numbers import degrees, signed

if TYPE_CHECKING:
    from rig.analysis.summary import Incline


Bars = Literal["U95", "u", "SE", "SD", "half-SD"]
"""Meaning of the bars on a mean, chosen by the user: its expanded or standard uncertainty, its
standard error by scatter alone, the standard deviation of a run, or half of that, as in
Pantaleone's figures."""
LABELS: dict[Bars, str] = {
    "U95": "U (95 %)",
    "u": "u",
    "SE": "SE",
    "SD": "SD of one run",
    "half-SD": "SD/2 of one run",
}


class Mean(NamedTuple):
    """Mean of a measurand in a line of the summary, with properties for tables."""

    line: Incline
    row: Measurand

    @property
    def mean(self) -> Measured:
        """The mean."""
        return self.line.means[self.row.name]

    @property
    def error(self) -> float | None:
        """Eₙ: within ±1 measurement and prediction agree."""
        return self.line.normalized_error(self.row.name)

    @property
    def causes(self) -> str:
        """The largest of the common sources of its uncertainty."""
        return ", ".join([*self.line.causes.get(self.row.name, ())][:2])

    @property
    def bars(self) -> dict[Bars, float | None]:
        """Half-length of each kind of bar; `None` for the scatter of a single run."""
        sd = self.line.deviations.get(self.row.name)
        return {
            "U95": self.mean.expanded,
            "u": self.mean.u,
            "SE": sd and sd / math.sqrt(self.line.n),
            "SD": sd,
            "half-SD": sd and sd / 2.0,
        }


def means_of(summary: Sequence[Incline], *rows: Measurand) -> list[Mean]:
    """Return the means of these measurands, by default of all, in all lines of the summary."""
    return [
        Mean(line, row) for row in rows or averaged() for line in summary if row.name in line.means
    ]


def means_parts(summary: Sequence[Incline]) -> list[Part]:
    """Return tables of means with the model's values, with a line for each unlike chain."""
    return [part for row in averaged() for part in tables("model", means_of(summary, row), row=row)]


def scatter_parts(summary: Sequence[Incline]) -> Iterator[Part]:
    """Yield the table of scatter."""
    return tables("scatter", (mean for line in summary for mean in means_of([line])))


_CELLS: dict[str, Callable[[Any], str]] = {
    "incline": lambda line: (
        "" if acceleration_in(line.means) else degrees(line.condition.incline_deg)
    ),
    "prior_incline": lambda move: (
        "" if acceleration_in([move["quantity"]]) else degrees(move["incline_deg"])
    ),
    "run_incline": lambda drop: "" if drop.run.impact is None else degrees(drop.run.incline_deg),
    "edges": lambda drop: " / ".join(str(getattr(drop.audit, name)) for name in COUNTS),
    "reasons": lambda drop: signed(sentences(drop.reasons)),
    "remedies": lambda drop: "; ".join(remedies(drop.reasons)) if drop.verdict == "void" else "",
}

tables = partial(table_parts, derived=_CELLS)
"""Yields a table of ``columns.txt`` for means or drops."""


def summary_table(summary: Sequence[Incline]) -> str:
    """Return the summary as aligned text, a block for each measurand, at most 80 columns wide.

    Returns
    -------
    str
        Lines without a final newline; a sentence if there is no summary.
    """
    blocks = ["\n".join(part.table) for part in means_parts(summary)]
    return "\n\n".join(blocks) or "No accepted runs, so no summary."
