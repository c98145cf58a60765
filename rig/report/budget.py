"""Uncertainty budgets as stacked bars, a bar for each incline."""

from __future__ import annotations

import math
from statistics import fmean
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.result import GOOD
from rig.measurands import averaged
from rig.report.canvas import INK, PAPER, PARTS, canvas
from rig.report.columns import summary_incline
from rig.report.embed import PageFigure

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.axes import Axes

    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand

REST = "all others"


class Stack(NamedTuple):
    """The bar of an incline.

    Attributes
    ----------
    u
        Standard uncertainty of one run, the root mean square of the runs, SI.
    shares
        Of its square, by source.
    """

    line: Incline
    u: float
    shares: Mapping[str, float]


def stacks(analysis: Analysis, row: Measurand) -> Iterator[Stack]:
    """Yield what makes the uncertainty of one run, incline by incline; runs that count alone."""
    for line in analysis.summary:
        budgets = [
            one.quantities[row.name].budget
            for one in analysis.runs
            if one.verdict in GOOD
            and row.name in one.quantities
            and one.run.incline_deg == line.incline_deg
            and line.impact_chain in {None, one.run.impact}
            and one.quantities[row.name].budget
        ]
        if not budgets or row.name not in line.means:
            continue
        sources = dict.fromkeys(source for budget in budgets for source in budget)
        squares = {
            source: fmean(budget.get(source, 0.0) ** 2 for budget in budgets) for source in sources
        }
        whole = sum(squares.values())
        if whole > 0.0:
            shares = {source: square / whole for source, square in squares.items()}
            yield Stack(line, math.sqrt(whole), shares)


def largest(found: Sequence[Stack]) -> list[str]:
    """Name the sources with a colour of their own, those that are largest anywhere first."""
    most: dict[str, float] = {}
    for stack in found:
        for source, share in stack.shares.items():
            most[source] = max(most.get(source, 0.0), share)
    ordered = sorted(most, key=lambda source: (-most[source], source))
    return ordered[: len(PARTS) - 1]


def budget_figure(analysis: Analysis, simulated: bool) -> PageFigure | None:
    """Draw a bar for each incline, as long as the uncertainty of one run, cut up by its sources.

    Returns
    -------
    PageFigure or None
        `None` where no run has a budget.
    """
    shown = [(row, found) for row in averaged() if (found := list(stacks(analysis, row)))]
    if not shown:
        return None
    named = largest([stack for _, found in shown for stack in found])
    bars = max(len(found) for _, found in shown)
    with canvas(
        (2.0 + 0.24 * bars,), simulated=simulated, columns=len(shown), sharex=False
    ) as drawing:
        for axes, (row, found) in zip(drawing.axes, shown, strict=True):
            _bars(axes, row, found, named)
        handles, labels = drawing.axes[0].get_legend_handles_labels()
        drawing.figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return PageFigure(
        drawing.svg,
        "Standard uncertainty of one run by its sources",
        "Each bar is u, the standard uncertainty of one run (root mean square over its line). "
        "Its parts are shares of u². The diamond is u of the mean: the scatter of the runs over "
        "√n, and everything that all runs share.",
        "budget",
    )


def _bars(axes: Axes, row: Measurand, found: Sequence[Stack], named: Sequence[str]) -> None:
    places = range(len(found))
    left = [0.0] * len(found)
    for source, color in zip((*named, REST), PARTS[: len(named)] + PARTS[-1:], strict=True):
        widths = [row.fine_scale * stack.u * _share(stack.shares, source, named) for stack in found]
        if any(widths):
            axes.barh(places, widths, left=left, height=0.7, color=color, edgecolor=INK,
                      linewidth=0.4, label=source)  # fmt: skip
        left = [start + width for start, width in zip(left, widths, strict=True)]
    means = [row.fine_scale * stack.line.means[row.name].u for stack in found]
    axes.plot(means, places, "D", color=INK, markersize=4.5, markeredgecolor=PAPER,
              markeredgewidth=0.8, linestyle="none", label="u of the mean")  # fmt: skip
    axes.set_yticks(places, [_named(stack.line) for stack in found])
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.grid(visible=True, axis="x")
    axes.set_xlabel(f"u of {row.symbol} ({row.fine})")


def _share(shares: Mapping[str, float], source: str, named: Sequence[str]) -> float:
    if source != REST:
        return shares.get(source, 0.0)
    return sum(share for name, share in shares.items() if name not in named)


def _named(line: Incline) -> str:
    tilt = summary_incline(line)
    return " ".join(filter(None, [f"{tilt}°" if tilt else "all runs", line.impact_chain]))
