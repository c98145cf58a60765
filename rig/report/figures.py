"""Figures of a session's results: pure functions of the result, as plain data."""

from __future__ import annotations

from itertools import groupby, pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.measurands import RELEASE_SKEW, SEPARATION, SPEED, acceleration_in, averaged
from rig.protocol.protocol import Condition
from rig.report.bars import LABELS, bar
from rig.report.figure import Chart, Panel, PlotAxis, Trace, residual_panel
from rig.report.looks import INK, MODEL, MUTED, PARTS, REST, RULE, SECOND
from rig.report.numbers import fixed, plus_minus, value_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand
    from rig.report.bars import Bars
    from rig.report.figure import Role

FEWEST_INCLINES = 3
"""Below, a curve against incline says less than the runs themselves."""
_GAP_DEG = 2.0  # the curve has a point each degree
_INCLINE = PlotAxis("incline of the surface (°)")
_RUN = PlotAxis("run", whole=True)
_SEGMENTS: dict[str, tuple[Any, str]] = {"surface": ("line", "model ± U"), "pile": ("dash", "pile")}
_SMALL = 0.04
"""Share of U² below which a source is among the others."""


def result_figures(
    analysis: Analysis,
    curves: Mapping[str, Any],
    *,
    simulated: bool,
    bars: Bars = "U95",
    site_m_s2: float | None = None,
) -> Iterator[Chart]:
    """Yield the figure of the session's result: against incline, or run by run where that is one.

    Parameters
    ----------
    curves
        The model, as `rig.analysis.curves.model_curves` gives it; empty draws none.
    simulated
        Whether to stamp figures.
    bars
        What the bars on means stand for.
    site_m_s2
        Expected gravity, for scenes without a surface.
    """
    measured = {name for run in analysis.runs for name in run.quantities}
    rows = [row for row in averaged() if row.name in measured]
    inclines = {run.run.incline_deg for run in analysis.runs}
    if not rows:
        return
    if len(inclines) >= FEWEST_INCLINES and acceleration_in(measured) is None:
        panels = [panel for row in rows for panel in _incline_panels(analysis, curves, row, bars)]
        hidden = " Shaded inclines: the rods would not slide, the model has no answer."
        yield Chart(
            f"{' and '.join(_title(row) for row in rows)} against incline",
            f"Line: model with its U. Points: means ± {LABELS[bars]} over single runs (small). "
            "Lower panels: mean less model, in units of U."
            + (hidden if unanswered(curves) else ""),
            panels,
            simulated,
        )
    else:
        yield Chart(
            f"{' and '.join(_title(row) for row in rows)} of each run",
            "Each run ± U (95 %); the band is the mean ± U.",
            [_runs_panel(analysis, row, site_m_s2) for row in rows],
            simulated,
        )


def runs_figure(
    analysis: Analysis, *, simulated: bool, skew_limit_s: float | None = None
) -> Chart | None:
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
    runs = sorted(analysis.runs, key=attrgetter("run.number"))
    names = {name for run in runs for name in run.quantities}
    panels = []
    if SEPARATION.name in names:
        references, words = _references(analysis.summary)
        label = f"Δz − {words}\n({SEPARATION.fine})"
        zero = Trace("", (), (0.0,), "level", MODEL)
        scale = SEPARATION.fine_scale
        points = _run_series(runs, SEPARATION, scale, references)
        panels.append(Panel(_RUN, PlotAxis(label), [zero, *points], 90.0))
    if RELEASE_SKEW.name in names:
        row = RELEASE_SKEW
        limits = [limit * row.scale for limit in (skew_limit_s or 0.0, -(skew_limit_s or 0.0))]
        edges = [Trace("limit", (), limits, "limit", SECOND)] if skew_limit_s else []
        points = _run_series(runs, row, row.scale)
        panels.append(Panel(_RUN, PlotAxis(f"{row.label}\n({row.unit})"), [*edges, *points], 70.0))
    if not panels:
        return None
    words = (
        "Runs in order ± U (95 %). If A and B differ above, the chains differ; a skew that stays "
    )
    words += "when they change places belongs to the sides."
    return Chart("Runs in order", words, panels, simulated)


def budget_figure(summary: Sequence[Incline], *, simulated: bool) -> Chart | None:
    """Draw for each quantity which share of U² of its means each source makes.

    Returns
    -------
    Chart or None
        `None` where no mean has a budget.
    """
    shares = {row: parts for row in averaged() if (parts := variance_shares(summary, row))}
    if not shares:
        return None
    most: dict[str, float] = {}
    for parts in shares.values():
        for source, share in parts.items():
            most[source] = max(most.get(source, 0.0), share)
    named = [name for name in sorted(most, key=lambda name: -most[name]) if most[name] > _SMALL]
    colors = dict(zip(named, PARTS, strict=False))
    panels: list[Panel] = []
    for row, parts in shares.items():
        begin, series = 0.0, []
        for source in named:
            if source in colors and parts.get(source, 0.0) > _SMALL:
                end = begin + 100.0 * parts[source]
                series.append(Trace(f"{source} {fixed(end - begin, 0)} %", (end,), (0.0,), "bar",
                                     colors[source], base=(begin,)))  # fmt: skip
                begin = end
        if begin < 99.5:
            words = f"others {fixed(100.0 - begin, 0)} %"
            series.append(Trace(words, (100.0,), (0.0,), "bar", REST, base=(begin,)))
        last = len(panels) == len(shares) - 1
        axis = PlotAxis("share of U² of the mean (%)" if last else "", limits=(0.0, 100.0))
        names = PlotAxis("", {0.0: row.symbol}, (-2.0, 0.6))
        panels.append(Panel(axis, names, series, 64.0))
    words = "Averaged over all means. “Runs” falls with more runs; all other parts do not."
    return Chart("What makes U", words, panels, simulated)


def variance_shares(summary: Sequence[Incline], row: Measurand) -> dict[str, float]:
    """Return which share of the variance of the means each source makes, the runs' scatter too."""
    squares: dict[str, float] = {}
    for line in summary:
        mean = line.means.get(row.name)
        if mean is None or not mean.u or "common" not in mean.budget:
            continue
        squares["runs"] = squares.get("runs", 0.0) + (mean.budget.get("runs", 0.0) / mean.u) ** 2
        causes = line.causes.get(row.name, {})
        whole = sum(u**2 for u in causes.values())
        for cause, u in causes.items():
            # What the runs have in common, parted as their own budgets part it.
            part = (mean.budget["common"] / mean.u) ** 2 * u**2 / whole
            squares[cause] = squares.get(cause, 0.0) + part
    total = sum(squares.values())
    return {name: square / total for name, square in squares.items()} if total else {}


def unanswered(curves: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Inclines between those of the model's curves for which it has no answer, degrees."""
    inclines = sorted(set(curves.get("incline_deg", ())))
    return [(low, high) for low, high in pairwise(inclines) if high - low > _GAP_DEG]


def _title(row: Measurand) -> str:
    return f"{row.title} {row.symbol}"


def _incline_panels(
    analysis: Analysis, curves: Mapping[str, Any], row: Measurand, bars: Bars
) -> Iterator[Panel]:
    """Yield a measurand against incline, and below it what it is off by."""
    good = [run for run in analysis.runs if run.verdict in GOOD and row.name in run.quantities]
    values = [run.quantities[row.name].value * row.scale for run in good]
    lines = [line for line in analysis.summary if row.name in line.means]
    inclines = [line.incline_deg for line in lines]
    means = [line.means[row.name].value * row.scale for line in lines]
    widths = [(bar(line, row.name, bars) or 0.0) * row.scale for line in lines]
    series = [
        *_model_series(curves, row),
        Trace("", [run.run.incline_deg for run in good], values, "points", MUTED),
        Trace("means", inclines, means, "mean", INK, widths),
    ]
    yield Panel(_INCLINE, PlotAxis(f"{row.title}\n{row.symbol} ({row.unit})"), series, 110.0)
    errors = [(line.incline_deg, line.normalized_error(row.name)) for line in lines]
    known = [(incline, error) for incline, error in errors if error is not None]
    if known:
        yield residual_panel(_INCLINE, *map(list, zip(*known, strict=True)))


def _model_series(curves: Mapping[str, Any], row: Measurand) -> Iterator[Trace]:
    """Yield the model's curve part by part, with its bands and the inclines it cannot answer."""
    if row.name not in curves:
        return
    for gap in unanswered(curves):
        yield Trace("", gap, (), "gap", RULE)
    inclines, first = curves["incline_deg"], None
    names = curves.get("segments") or ["surface"] * len(inclines)
    for name, part in groupby(range(len(names)), key=lambda index: names[index]):
        where, _, chain = name.partition(", ")  # unlike chains have curves of their own
        first = chain if first is None else first
        color = MODEL if chain == first else SECOND
        role, label = _SEGMENTS[where]
        places = list(part)
        at = [inclines[place] for place in places]
        values = [row.scale * curves[row.name][place] for place in places]
        widths = [row.scale * curves[row.key("U95")][place] for place in places]
        yield Trace("", at, values, "band", color, widths)
        yield Trace(f"{label}, {chain}" if chain else label, at, values, role, color)
    speed = value_of(curves.get("free_fall_speed_m_s"))
    if row == SPEED and speed is not None:
        yield Trace("free fall", (), (speed,), "limit", MUTED)


def _runs_panel(analysis: Analysis, row: Measurand, site_m_s2: float | None) -> Panel:
    """Draw a measurand of each run, its mean with U as a band, and what is expected."""
    runs = sorted(analysis.runs, key=attrgetter("run.number"))
    series = []
    expected = site_m_s2 if acceleration_in([row.name]) else None
    for line in analysis.summary:
        if row.name in line.means:
            mean = line.means[row.name]
            low, high = ((mean.value + way * mean.expanded) * row.scale for way in (-1, 1))
            series.append(Trace("", (), (low, high), "shade", MODEL))
            words = f"mean {plus_minus(mean, row.scale, row.decimals)} {row.unit}"
            series.append(Trace(words, (), (mean.value * row.scale,), "level", MODEL))
            expected = expected or value_of(line.predicted.get(row.name))
    if expected is not None:
        words = f"expected {fixed(expected * row.scale, row.decimals)}"
        series.append(Trace(words, (), (expected * row.scale,), "limit", SECOND))
    series += _run_series(runs, row, row.scale)
    return Panel(_RUN, PlotAxis(f"{row.title}\n{row.symbol} ({row.unit})"), series, 110.0)


def _run_series(
    runs: Sequence[DropResult],
    row: Measurand,
    scale: float,
    references: Mapping[Condition, float] | None = None,
) -> Iterator[Trace]:
    """Yield a quantity of every run: a series for each chain that strikes, void runs as crosses."""
    chains = sorted({run.run.impact or "" for run in runs})
    groups: dict[str | None, list[tuple[float, float, float]]] = {}
    for run in runs:
        measured = run.quantities.get(row.name)
        reference = 0.0 if references is None else _reference(run, references)
        if measured is not None and reference is not None:
            group = (run.run.impact or "") if run.verdict in GOOD else None
            point = run.run.number, (measured.value - reference) * scale, measured.expanded * scale
            groups.setdefault(group, []).append(point)
    for chain in [*chains, None]:
        if chain in groups:
            numbers, values, widths = map(list, zip(*groups[chain], strict=True))
            second = chain is not None and chains.index(chain) % 2
            role: Role = "ring" if second else "mean" if chain is not None else "cross"
            color = SECOND if second else INK if chain is not None else MUTED
            words = f"{chain} strikes" if chain else "" if chain is not None else "not counted"
            yield Trace(words, numbers, values, role, color, widths if chain is not None else ())


def _reference(run: DropResult, references: Mapping[Condition, float]) -> float | None:
    like = Condition(run.run.incline_deg)  # where it makes no difference which one strikes
    return references.get(like._replace(impact_chain=run.run.impact), references.get(like))


def _references(summary: Sequence[Incline]) -> tuple[dict[Condition, float], str]:
    """Return what runs are compared with, by condition, and the words for it."""
    for words, attribute in (("model", "predicted"), ("mean", "means")):
        values = {
            line.condition: getattr(line, attribute)[SEPARATION.name].value
            for line in summary
            if SEPARATION.name in getattr(line, attribute)
        }
        if values:
            return values, words
    return {}, "mean"
