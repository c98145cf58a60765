"""Figures of a session's results: pure functions of the result, as plain data."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from itertools import groupby, pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.measurands import RELEASE_SKEW, SEPARATION, SPEED, acceleration_in, averaged
from rig.protocol.protocol import Condition
from rig.report.figure import Panel, PlotAxis, Trace, chart, measured, residual_panels, series
from rig.report.looks import INK, MODEL, MUTED, PARTS, REST, RULE, SECOND
from rig.report.numbers import fixed, plus_minus, value_of
from rig.report.parts import LABELS, means_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rig.analysis.result import Measured
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand
    from rig.report.figure import Chart, Role
    from rig.report.parts import Bars

FEWEST_INCLINES = 3
"""Below, a curve against incline says less than the runs themselves."""
_GAP_DEG = 2.0  # the curve has a point each degree
_INCLINE = PlotAxis("incline of the surface (°)")
_RUN = PlotAxis("run", whole=True)
_SEGMENTS: dict[str, tuple[Any, str]] = {"surface": ("line", "model ± U"), "pile": ("dash", "pile")}
_REFERENCES = {"predicted": "model", "means": "mean"}
_HIDDEN = " Shaded inclines: the rods would not slide, the model has no answer."
_SMALL = 0.04
"""Share of U² below which a source is among the others."""


def result_figure(
    analysis: Analysis,
    curves: Mapping[str, Any],
    bars: Bars = "U95",
    site_m_s2: float | None = None,
) -> Chart | None:
    """Draw a session's result: against incline, or run by run where that is one.

    Parameters
    ----------
    curves
        The model, as `rig.analysis.curves.model_curves` gives it; empty draws none.
    bars
        What the bars on means stand for.
    site_m_s2
        Expected gravity, for scenes without a surface.
    """
    measured = {name for run in analysis.runs for name in run.quantities}
    rows = [row for row in averaged() if row.name in measured]
    if not rows:
        return None
    title = " and ".join(f"{row.title} {row.symbol}" for row in rows)
    inclines = {run.run.incline_deg for run in analysis.runs}
    if len(inclines) < FEWEST_INCLINES or acceleration_in(measured):
        panels = [_runs_panel(analysis, row, site_m_s2) for row in rows]
        return chart("runs", panels, title=title)
    panels = [panel for row in rows for panel in _incline_panels(analysis, curves, row, bars)]
    hidden = _HIDDEN if unanswered(curves) else ""
    return chart("incline", panels, title=title, bars=LABELS[bars], hidden=hidden)


def runs_figure(analysis: Analysis, skew_limit_s: float | None = None) -> Chart | None:
    """Draw every run in order: Δz less its prediction (or mean), and the release skew below.

    Parameters
    ----------
    skew_limit_s
        Beyond which a run is void, s; `None` draws no limits.

    Returns
    -------
    Chart or None
        `None` where there are no two chains.
    """
    # Runs are compared with the model, or with their mean where it has no answer.
    words = "predicted" if any(line.predicted for line in analysis.summary) else "means"
    references = {
        line.condition: reference.value
        for line in analysis.summary
        if (reference := getattr(line, words).get(SEPARATION.name)) is not None
    }
    panels = []
    if any(SEPARATION.name in run.quantities for run in analysis.runs):
        points = _run_series(analysis, SEPARATION, SEPARATION.fine_scale, references)
        axis = PlotAxis(f"Δz − {_REFERENCES[words]}\n({SEPARATION.fine})")
        panels.append(Panel(_RUN, axis, [Trace("", (), (0.0,), "level", MODEL), *points], 90.0))
    if any(RELEASE_SKEW.name in run.quantities for run in analysis.runs):
        row, limits = RELEASE_SKEW, (skew_limit_s or 0.0, -(skew_limit_s or 0.0))
        ends = [series("limit", (), limits, "limit", SECOND, scale=row.scale)]
        points = _run_series(analysis, row, row.scale)
        axis = PlotAxis(f"{row.label}\n({row.unit})")
        panels.append(Panel(_RUN, axis, [*(ends if skew_limit_s else ()), *points], 70.0))
    return chart("order", panels) if panels else None


def budget_figure(summary: Sequence[Incline]) -> Chart | None:
    """Draw for each quantity which share of U² of its means each source makes.

    Returns
    -------
    Chart or None
        `None` where no mean has a budget.
    """
    shares = {row: parts for row in averaged() if (parts := variance_shares(summary, row))}
    most: dict[str, float] = {}
    for parts in shares.values():
        most |= {name: max(share, most.get(name, 0.0)) for name, share in parts.items()}
    named = sorted((name for name in most if most[name] > _SMALL), key=lambda name: -most[name])
    # The same source has the same colour for all quantities.
    colors = dict(zip(named, PARTS, strict=False))
    panels = []
    for row, parts in shares.items():
        axis = PlotAxis(
            "share of U² of the mean (%)" if row == [*shares][-1] else "", limits=(0.0, 100.0)
        )
        names = PlotAxis("", {0.0: row.symbol}, (-2.0, 0.6))
        panels.append(Panel(axis, names, [*_stacked(parts, colors)], 64.0))
    return chart("budget", panels) if panels else None


def variance_shares(summary: Sequence[Incline], row: Measurand) -> dict[str, float]:
    """Return which share of the variance of the means each source makes, the runs' scatter too."""
    squares = defaultdict[str, float](float)
    for line in summary:
        mean = line.means.get(row.name)
        if mean is not None and mean.u and "common" in mean.budget:
            causes = line.causes.get(row.name, {})
            # What the runs have in common, parted as their own budgets part it.
            part = (mean.budget["common"] / mean.u) ** 2 / (sum(u**2 for u in causes.values()) or 1)
            squares["runs"] += (mean.budget.get("runs", 0.0) / mean.u) ** 2
            for cause, u in causes.items():
                squares[cause] += part * u**2
    total = sum(squares.values())
    return {name: square / total for name, square in squares.items()} if total else {}


def unanswered(curves: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Inclines between those of the model's curves for which it has no answer, degrees."""
    inclines = sorted(set(curves.get("incline_deg", ())))
    return [(low, high) for low, high in pairwise(inclines) if high - low > _GAP_DEG]


def _stacked(parts: Mapping[str, float], colors: Mapping[str, int]) -> Iterator[Trace]:
    """Yield one bar, source after source."""
    begin = 0.0
    shown = {name: 100.0 * parts[name] for name in colors if parts.get(name, 0.0) > _SMALL}
    rest = 100.0 - sum(shown.values())
    for name, share in [*shown.items(), *([("others", rest)] if rest > 0.5 else [])]:
        words = f"{name} {fixed(share, 0)} %"
        yield Trace(words, (begin + share,), (0.0,), "bar", colors.get(name, REST), base=(begin,))
        begin += share


def _incline_panels(
    analysis: Analysis, curves: Mapping[str, Any], row: Measurand, bars: Bars
) -> Iterator[Panel]:
    """Yield a measurand against incline, and below it what it is off by."""
    means = means_of(analysis.summary, row)
    inclines = [mean.line.incline_deg for mean in means]
    widths = [mean.bars[bars] or 0.0 for mean in means]
    good = (run for run in analysis.runs if run.verdict in GOOD and row.name in run.quantities)
    single = ((run.run.incline_deg, run.quantities[row.name]) for run in good)
    traces = [
        *_model_series(curves, row),
        measured("", single, "points", MUTED, row.scale),
        series(
            "means", inclines, [mean.mean.value for mean in means], "mean", INK, widths, row.scale
        ),
    ]
    yield Panel(_INCLINE, PlotAxis(f"{row.title}\n{row.symbol} ({row.unit})"), traces, 110.0)
    errors = [(mean.line.incline_deg, mean.error) for mean in means if mean.error is not None]
    yield from residual_panels(_INCLINE, errors)


def _model_series(curves: Mapping[str, Any], row: Measurand) -> Iterator[Trace]:
    """Yield the model's curve part by part, with its bands and the inclines it cannot answer."""
    if row.name not in curves:
        return
    for gap in unanswered(curves):
        yield Trace("", gap, (), "gap", RULE)
    inclines = curves["incline_deg"]
    names = curves.get("segments") or ["surface"] * len(inclines)
    points = zip(names, inclines, curves[row.name], curves[row.key("U95")], strict=True)
    first = names[0].partition(", ")[2]
    for name, part in groupby(points, key=lambda point: point[0]):
        where, _, chain = name.partition(", ")  # unlike chains have curves of their own
        color = MODEL if chain == first else SECOND
        role, label = _SEGMENTS[where]
        _, at, values, widths = zip(*part, strict=True)
        yield series("", at, values, "band", color, widths, row.scale)
        words = f"{label}, {chain}" if chain else label
        yield series(words, at, values, role, color, scale=row.scale)
    speed = value_of(curves.get("free_fall_speed_m_s"))
    if row == SPEED and speed is not None:
        yield Trace("free fall", (), (speed,), "limit", MUTED)


def _runs_panel(analysis: Analysis, row: Measurand, site_m_s2: float | None) -> Panel:
    """Draw a measurand of each run, its mean with U as a band, and what is expected."""
    traces = []
    expected = site_m_s2 if acceleration_in([row.name]) else None
    for line, _ in means_of(analysis.summary, row):
        mean = line.means[row.name]
        words = f"mean {plus_minus(mean, row.scale, row.decimals)} {row.unit}"
        ends = mean.value - mean.expanded, mean.value + mean.expanded
        traces += [
            series("", (), ends, "shade", MODEL, scale=row.scale),
            series(words, (), (mean.value,), "level", MODEL, scale=row.scale),
        ]
        expected = expected or value_of(line.predicted.get(row.name))
    if expected is not None:
        words = f"expected {fixed(expected * row.scale, row.decimals)}"
        traces.append(series(words, (), (expected,), "limit", SECOND, scale=row.scale))
    traces += _run_series(analysis, row, row.scale)
    return Panel(_RUN, PlotAxis(f"{row.title}\n{row.symbol} ({row.unit})"), traces, 110.0)


def _run_series(
    analysis: Analysis,
    row: Measurand,
    scale: float,
    references: Mapping[Condition, float] | None = None,
) -> Iterator[Trace]:
    """Yield a quantity of every run: a series for each chain that strikes, void runs as crosses."""
    groups: dict[str | None, list[tuple[float, Measured]]] = {}
    for run in sorted(analysis.runs, key=attrgetter("run.number")):
        like = Condition(run.run.incline_deg)  # where it makes no difference which one strikes
        own = like._replace(impact_chain=run.run.impact)
        reference = references.get(own, references.get(like)) if references is not None else 0.0
        if row.name in run.quantities and reference is not None:
            value = run.quantities[row.name]
            point = run.run.number, replace(value, value=value.value - reference)
            group = (run.run.impact or "") if run.verdict in GOOD else None
            groups.setdefault(group, []).append(point)
    if None in groups:
        yield measured("not counted", groups.pop(None), "cross", MUTED, scale)
    looks: tuple[tuple[Role, int], ...] = (("mean", INK), ("ring", SECOND))
    for (chain, points), (role, color) in zip(sorted(groups.items()), looks, strict=False):
        yield measured(f"{chain} strikes" if chain else "", points, role, color, scale)
