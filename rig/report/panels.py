"""Panels whose horizontal axis counts the runs: points, limits and marks."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from rig.analysis.result import GOOD
from rig.measurands import RELEASE_SKEW
from rig.protocol.protocol import Condition
from rig.report.canvas import INK, MODEL, MUTED, PAPER, SECOND, annotate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from rig.analysis.result import DropResult
    from rig.measurands import Measurand

_CHAIN_STYLES = (("o", MODEL, MODEL), ("s", SECOND, PAPER), ("^", INK, INK), ("D", MUTED, PAPER))


def run_points(
    axes: Axes,
    runs: Sequence[DropResult],
    row: Measurand,
    references: Mapping[Condition, float] | None = None,
) -> None:
    """Plot a quantity of every run, a marker for each chain, a cross for runs that do not count."""
    chains = sorted({one.run.impact or "" for one in runs})
    groups: dict[tuple[str, bool], list[tuple[int, float, float]]] = {}
    for one in runs:
        measured = one.quantities.get(row.name)
        reference: float | None = 0.0
        if references is not None:
            like = Condition(one.run.incline_deg)  # where it makes no difference which one strikes
            reference = references.get(
                like._replace(impact_chain=one.run.impact), references.get(like)
            )
        if measured is None or reference is None:
            continue
        counts = one.verdict in GOOD
        group = ((one.run.impact or "") if counts else "", counts)
        point = (measured.value - reference) * row.scale, measured.expanded * row.scale
        groups.setdefault(group, []).append((one.run.number, *point))
    for (chain, counts), points in sorted(groups.items(), key=lambda item: not item[0][1]):
        numbers, values, bars = zip(*points, strict=True)
        if not counts:
            # Plotted last, on the scale of the runs that count: one lost edge can put a void run
            # a metre off.
            low, high = axes.get_ylim()
            if len(groups) > 1 and row != RELEASE_SKEW:
                axes.set_ylim(low, high)
            else:
                low, high = min(values), max(values)
            beyond = sum(not low <= value <= high for value in values)
            label = f"void or rejected ({beyond} off the scale)" if beyond else "void or rejected"
            axes.plot(numbers, values, "x", color=MUTED, label=label, markersize=5)
            continue
        marker, color, face = _CHAIN_STYLES[chains.index(chain) % len(_CHAIN_STYLES)]
        axes.errorbar(
            numbers,
            values,
            yerr=bars,
            fmt=marker,
            color=color,
            markerfacecolor=face,
            markersize=4.2,
            elinewidth=0.8,
            capsize=0,
            label=f"chain {chain} strikes" if chain else "run ± U (95 %)",
            zorder=4,
        )


def limit_lines(axes: Axes, limit_ms: float) -> None:
    """Draw limits on both sides of zero and keep them in sight."""
    for sign in (-1, 1):
        axes.axhline(sign * limit_ms, color=SECOND, linewidth=1.0, linestyle=(0, (5, 2.5)))
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -1.15 * limit_ms), max(high, 1.15 * limit_ms))
    at, coords = (0.995, limit_ms), ("axes fraction", "data")
    annotate(axes, f"limit ±{limit_ms:g} ms", at, (0, 3), xycoords=coords, color=SECOND, ha="right")


def legend_above(axes: Axes) -> None:
    """Put the legend above all panels, where no point can hide behind it."""
    handles, labels = axes.get_legend_handles_labels()
    figure = axes.get_figure()
    if handles and figure is not None:
        figure.legend(handles, labels, loc="outside upper left", ncols=2 if len(labels) == 4 else 3)


def run_axis(axes: Axes) -> None:
    """Label the axis of run numbers with whole numbers."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - see canvas

    axes.set_xlabel("run")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    axes.margins(x=0.02)


def mark_inclines(panels: Sequence[Axes], runs: Sequence[DropResult]) -> None:
    """Mark where the inclination changes, as long as the marks stay readable."""
    blocks = [
        (incline, [one.run.number for one in block])
        for incline, block in groupby(runs, key=lambda one: one.run.incline_deg)
    ]
    if not 1 < len(blocks) <= 16:
        return
    for place, (incline, numbers) in enumerate(blocks):
        low, high = numbers[0] - 0.5, numbers[-1] + 0.5
        for axes in panels:
            if place:
                axes.axvline(low, color=MUTED, linewidth=0.6, alpha=0.6)
        at, look = ((low + high) / 2, 1.0), {"ha": "center", "va": "bottom", "color": MUTED}
        annotate(panels[0], f"{incline:g}°", at, (0, 2), xycoords=("data", "axes fraction"), **look)
