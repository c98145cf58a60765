"""Tables of a session's results, for the page and the terminal alike."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from rig.analysis.result import COUNTS
from rig.measurands import MEASURANDS, acceleration_in, averaged
from rig.reasons import remedies, sentences
from rig.report.columns import table_parts
from rig.report.numbers import degrees, signed

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rig.analysis.pairs import Effects
    from rig.analysis.result import DropResult, Measured
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand
    from rig.report.columns import Part


Bars = Literal["U95", "u", "SE", "SD", "half-SD"]
"""What the bars on a mean stand for, which is the reader's choice: its expanded or standard
uncertainty, its standard error by scatter alone, the standard deviation of one run, or half of it,
as in Pantaleone's figures."""
LABELS: dict[Bars, str] = {
    "U95": "U (95 %)",
    "u": "u",
    "SE": "SE",
    "SD": "SD of one run",
    "half-SD": "SD/2 of one run",
}


class Mean(NamedTuple):
    """A measurand of a line of the summary that has its mean, as tables ask for it."""

    line: Incline
    row: Measurand

    @property
    def incline(self) -> str:
        """The inclination of the line."""
        return summary_incline(self.line)

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
        """Half the length of each kind of bar; `None` for the scatter of a single run."""
        sd = self.line.deviations.get(self.row.name)
        return {
            "U95": self.mean.expanded,
            "u": self.mean.u,
            "SE": sd and sd / math.sqrt(self.line.n),
            "SD": sd,
            "half-SD": sd and sd / 2.0,
        }


def means_of(summary: Sequence[Incline], row: Measurand) -> list[Mean]:
    """Return the lines that have a mean of a measurand."""
    return [Mean(line, row) for line in summary if row.name in line.means]


def summary_incline(line: Incline) -> str:
    """Write the inclination of a mean; nothing where nothing is struck, so nothing is inclined."""
    return "" if acceleration_in(line.means) else degrees(line.incline_deg)


def main_error(line: Incline) -> float | None:
    """Eₙ of the first of the quantities, which is what the scene is for."""
    return line.normalized_error(next(iter(line.means)))


def means_parts(summary: Sequence[Incline]) -> list[Part]:
    """Return the means of each measurand beside the model; unlike chains have a line each."""
    return [
        part for row in averaged() for part in table_parts("model", means_of(summary, row), row=row)
    ]


def value_parts(summary: Sequence[Incline]) -> Iterator[Part]:
    """Yield the means without the model."""
    return table_parts("means", summary, incline=summary_incline)


def budget_parts(summary: Sequence[Incline]) -> Iterator[Part]:
    """Yield the table of what makes the uncertainty of the means, where anything is known of it."""
    means = [mean for row in averaged() for mean in means_of(summary, row)]
    return table_parts("budget", (mean for mean in means if mean.mean.budget))


def scatter_parts(summary: Sequence[Incline]) -> Iterator[Part]:
    """Yield the table of scatter."""
    return table_parts(
        "scatter",
        (mean for line in summary for row in averaged() for mean in means_of([line], row)),
    )


def prior_parts(moves: Sequence[Mapping[str, Any]]) -> Iterator[Part]:
    """Yield the table of what means move by with each prior, see `rig analyze --priors`."""
    return table_parts("priors", ({**move, "row": MEASURANDS[move["quantity"]]} for move in moves))


def gate_parts(summary: Sequence[Incline]) -> Iterator[Part]:
    """Yield the section on what each gate saw of one object, where there is one."""
    return table_parts("gates", (gate for line in summary for gate in line.gates))


def effects_parts(effects: Sequence[Effects]) -> Iterator[Part]:
    """Yield the section on effects of chains and sides where there are any."""
    return table_parts("effects", effects)


def run_parts(drops: Iterable[DropResult]) -> Iterator[Part]:
    """Yield the table of drops; raw Δz is as it happened, not corrected to simultaneous release."""
    return table_parts("runs", drops, incline=_run_incline, edges=_edges)


def verdict_parts(drops: Iterable[DropResult]) -> Iterator[Part]:
    """Yield why drops are not accepted, and what to do about those that are void."""
    return table_parts(
        "verdicts",
        (drop for drop in drops if drop.verdict != "accepted"),
        incline=_run_incline,
        reasons=lambda drop: signed(sentences(drop.reasons)),
        remedies=lambda drop: "; ".join(remedies(drop.reasons)) if drop.verdict == "void" else "",
    )


def _run_incline(drop: DropResult) -> str:
    return "" if drop.run.impact is None else degrees(drop.run.incline_deg)


def _edges(drop: DropResult) -> str:
    return " / ".join(str(getattr(drop.audit, name)) for name in COUNTS)


def summary_table(summary: Sequence[Incline]) -> str:
    """Write the summary as aligned text, a block for each measurand, none wider than 80.

    Returns
    -------
    str
        Lines without an end of line at the last; one sentence where there is no summary.
    """
    blocks = ["\n".join(part.table) for part in means_parts(summary)]
    return "\n\n".join(blocks) or "No accepted runs, so no summary."
