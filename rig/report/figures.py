"""Figures of a session's results, as described in `figures.txt`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from operator import attrgetter, itemgetter
from typing import TYPE_CHECKING, Any

from rig.analysis.budget_lines import largest_first
from rig.analysis.result import GOOD
from rig.measurands import RELEASE_SKEW, SEPARATION, SPEED, Measurand, acceleration_in, averaged
from rig.protocol.protocol import Condition
from rig.report.figure import Chart, chart
from rig.report.looks import PARTS, REST
from rig.report.numbers import fixed, value_of, with_unit
from rig.report.parts import LABELS, Bars, means_of

if TYPE_CHECKING:  # a figure is drawn where no drop is analysed
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline

Groups = list[dict[str, Any]]

FEWEST_INCLINES = 3
"""Least number of inclines for a curve; with fewer, runs are shown instead."""
_GAP_DEG = 2.0  # the curve has a point each degree
_SEGMENTS = {"surface": ("line", "model ± U"), "pile": ("dash", "pile")}
_HIDDEN = " Shaded inclines: the rods would not slide, the model has no answer."
_CHAINS = " If A and B differ above, the chains differ."
_SMALL = 6.0
"""Percent of U² below which a source is merged with the others, for lack of room."""


def result_figure(
    analysis: Analysis, curves: Mapping[str, Any], bars: Bars = "U95"
) -> Chart | None:
    """Return the figure of results against incline, or by run for few inclines or other settings.

    Parameters
    ----------
    curves
        Predictions of `rig.analysis.curves.model_curves`; may be empty.
    bars
        Meaning of the bars on means.
    """
    good = [run for run in analysis.runs if run.verdict in GOOD]
    measured = {name for run in good for name in run.quantities}
    rows = [*averaged(measured)]
    if not rows:
        return None
    title = " and ".join(f"{row.title} {row.symbol}" for row in rows)
    # There is one curve only where nothing but the incline varies.
    inclines = {run.run.incline_deg for run in analysis.runs if not run.run.setting}
    if len(inclines) < FEWEST_INCLINES or acceleration_in(measured):
        return chart("runs", *(_by_run(analysis, row) for row in rows), title=title)
    gaps = _model_gaps(curves)
    sources = (
        {
            "row": row,
            "gaps": gaps,
            "model": [*_model_parts(curves, row)],
            "free_fall": [curves.get("free_fall_speed_m_s")] * (row == SPEED),
            "runs": good,
            "means": means_of(analysis.summary, row),
            "bars": bars,
        }
        for row in rows
    )
    hidden = _HIDDEN if gaps else ""
    return chart("incline", *sources, title=title, bars=LABELS[bars], hidden=hidden)


def runs_figure(analysis: Analysis, skew_limit_s: float | None = None) -> Chart | None:
    """Return the figure of all runs in order: Δz less its prediction (or mean), and release skew.

    Parameters
    ----------
    skew_limit_s
        Limit beyond which a run is void, s; `None` draws no limits.

    Returns
    -------
    Chart or None
        `None` unless there are two chains.
    """
    # Runs are compared with the model, or with their mean without a prediction.
    predicted = any(line.predicted for line in analysis.summary)
    references = {
        line.condition: reference.value
        for line in analysis.summary
        if (reference := (line.predicted if predicted else line.means).get(SEPARATION.name))
    }
    sources = {
        "reference": "model" if predicted else "mean",
        "separation": _runs_by_chain(analysis, SEPARATION, references),
        "skew": _runs_by_chain(analysis, RELEASE_SKEW),
        "limits": [skew_limit_s, -skew_limit_s] if skew_limit_s else (),
    }
    figure = chart("order", sources, chains=_CHAINS if sources["separation"] else "")
    return figure if figure.panels else None


def budget_figure(summary: Sequence[Incline]) -> Chart | None:
    """Return the figure of each source's share of U² of the means, for each quantity.

    Returns
    -------
    Chart or None
        `None` where no mean has a budget.
    """
    budgets = {row: parts for row in averaged() if (parts := variance_shares(summary, row))}
    colors: dict[str, int] = {}  # a source has the same colour for all quantities
    panels = [
        {
            "name": "share of U² of the mean (%)" if row == [*budgets][-1] else "",
            "parts": [*_stack_bar(parts, colors)],
            "x_axis": {"limits": (0.0, 100.0)},
            "y_axis": {"names": {0.0: row.symbol}, "limits": (-2.0, 0.6)},
        }
        for row, parts in budgets.items()
    ]
    return chart("budget", *panels) if panels else None


def variance_shares(summary: Sequence[Incline], row: Measurand) -> dict[str, float]:
    """Return the share of each source, including scatter, in the means' variance, percent."""
    squares = defaultdict[str, float](float)
    for line in summary:
        mean = line.means.get(row.name)
        if mean is not None and mean.u and "common" in mean.budget:
            causes = line.causes.get(row.name, {})
            # Split the common part in proportion to the runs' own budgets.
            part = (mean.budget["common"] / mean.u) ** 2 / (sum(u**2 for u in causes.values()) or 1)
            squares["runs"] += (mean.budget.get("runs", 0.0) / mean.u) ** 2
            for cause, u in causes.items():
                squares[cause] += part * u**2
    total = sum(squares.values())
    return {name: 100.0 * square / total for name, square in squares.items() if total}


def _model_gaps(curves: Mapping[str, Any]) -> Groups:
    """Return gaps of the model's curves, inclines without a prediction, degrees."""
    inclines = sorted(set(curves.get("incline_deg", ())))
    return [{"ends": ends} for ends in pairwise(inclines) if ends[1] - ends[0] > _GAP_DEG]


def _stack_bar(parts: Mapping[str, float], colors: dict[str, int]) -> Iterator[dict[str, Any]]:
    """Yield the segments of a bar, a source each, the largest first."""
    begin = 0.0
    for name, share in largest_first(parts).items():
        # Sources without a colour are merged with the others.
        color = colors.get(name) or dict(enumerate(PARTS)).get(len(colors))
        if share > _SMALL and color is not None:
            colors[name], points = color, [(begin + share, 0.0, begin)]
            yield {"part": name, "share": share, "color": color, "points": points}
            begin += share
    if begin < 99.5:
        points = [(100.0, 0.0, begin)]
        yield {"part": "others", "share": 100.0 - begin, "color": REST, "points": points}


def _model_parts(curves: Mapping[str, Any], row: Measurand) -> Iterator[dict[str, Any]]:
    """Yield the segments of the model's curve: on the surface, on the pile, for unlike chains."""
    if row.name not in curves:
        return
    names = curves.get("segments") or ["surface"] * len(curves["incline_deg"])
    columns = (curves[name] for name in ("incline_deg", row.name, row.key("U95")))
    first = names[0].partition(", ")[2]
    for name, points in groupby(zip(names, *columns, strict=True), key=itemgetter(0)):
        where, _, chain = name.partition(", ")  # unlike chains have separate curves
        role, words = _SEGMENTS[where]
        color, label = "model" if chain == first else "second", f"{words}, {chain}".rstrip(", ")
        yield {"role": role, "color": color, "label": label, "points": [*points]}


def _by_run(analysis: Analysis, row: Measurand) -> dict[str, Any]:
    """Return a measurand in each run, its mean with U as a band, and the expected value."""
    means = means_of(analysis.summary, row)
    expected = {value_of(mean.line.predicted.get(row.name)) for mean in means}
    stated = [value for value in expected if value is not None]
    stated *= len(stated) == 1
    return {
        "row": row,
        "means": [
            {
                "words": with_unit(mean, row),
                "middle": [mean.value],
                "ends": [mean.value - mean.expanded, mean.value + mean.expanded],
            }
            for mean in (each.mean for each in means)
        ],
        "expectations": stated,
        "expected": "".join(fixed(value * row.scale, row.decimals) for value in stated),
        "runs": _runs_by_chain(analysis, row),
    }


def _runs_by_chain(
    analysis: Analysis, row: Measurand, references: Mapping[Condition, float] | None = None
) -> Groups:
    """Return a quantity of all runs, a series for each striking chain; crosses for void runs."""
    points = defaultdict[str, list[Any]](list)
    for run in sorted(analysis.runs, key=attrgetter("run.number")):
        own = Condition(run.run.incline_deg, run.run.impact, run.run.setting)
        like = own._replace(impact_chain=None)  # for like chains
        reference = references.get(own, references.get(like)) if references is not None else 0.0
        value = run.quantities.get(row.name)
        if value is not None and reference is not None:
            point = run.run.number, replace(value, value=value.value - reference)
            strikes = f"{run.run.impact} strikes" if run.run.impact else ""
            points[strikes if run.verdict in GOOD else "not counted"].append(point)
    groups = [("not counted", points.pop("not counted", [])), *sorted(points.items())]
    looks = (("cross", "muted"), ("mean", "ink"), ("ring", "second"))
    return [
        {"label": label, "role": role, "color": color, "points": group}
        for (label, group), (role, color) in zip(groups, looks, strict=False)
        if group
    ]
