"""Sessions beside each other: tables, a figure and a page of their differences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.analysis.summary import Incline
from rig.measurands import acceleration_in, averaged
from rig.report.columns import Column, aligned, summary_table, verdict_on
from rig.report.figure import Chart, Panel, PlotAxis, Trace
from rig.report.looks import MODEL, MUTED
from rig.report.numbers import fixed, plus_minus
from rig.report.page import PageSection, ReportPage, page_html
from rig.report.parts import Part

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.measurands import Measurand
    from rig.results.together import MeanDifference, TogetherResults

_LESS = (
    "Differences are each session's mean less that of {reference}. Eₙ is the difference over its "
    "expanded uncertainty U (95 %): within ±1 both agree."
)
_SHARED = "Errors of what these have in common cancel: {words} ({names})."
_NOTHING = "Nothing is taken to be the same rig: no errors cancel."
_OWNERS = {
    "rig": "clock, gravity and air",
    "posts": "post zeros",
    "beams": "beam heights",
    "start": "drop height",
    "condition": "contact",
}


def shared_lines(results: TogetherResults) -> list[str]:
    """Say which errors the sessions have in common."""
    owners: dict[tuple[str, ...], list[str]] = {}
    for owner, groups in results.fit.shared.items():
        for group in groups:
            if len(group) > 1:
                owners.setdefault(tuple(group), []).append(_OWNERS.get(owner, owner))
    return [
        _SHARED.format(words=", ".join(words), names=", ".join(names))
        for names, words in owners.items()
    ] or [_NOTHING]


def pooled_lines(results: TogetherResults) -> Iterator[str]:
    """Yield the means over all sessions of each scene, as lines of text."""
    if results.simulated:
        yield "SIMULATED DATA"
    for scene in results.fit.pooled:
        yield from [f"{', '.join(scene.sessions)}:", *summary_table(scene.summary).splitlines()]
    yield from shared_lines(results)


def difference_lines(results: TogetherResults) -> Iterator[str]:
    """Yield the means of every session and their differences, as lines of text."""
    if results.simulated:
        yield "SIMULATED DATA"
    for part in _tables(results):
        yield from ["", *aligned(part.columns, part.records)]
    yield from ["", _less(results), *shared_lines(results)]


def comparison_page(results: TogetherResults) -> str:
    """Return the page that `rig compare -o` writes."""
    title = f"Comparison with {results.fit.parts[0].name}"
    claims = [_less(results), *shared_lines(results)]
    figures, tables = [draw_comparison(results)], [*_tables(results)]
    section = PageSection("results", "Results", claims, figures, tables)
    return page_html(ReportPage(title, [section], results.simulated))


def draw_comparison(results: TogetherResults) -> Chart:
    """Draw all differences with U (95 %), a panel for each measurand, zero as a line."""
    differences = results.differences()
    panels = [
        _difference_panel(row, members)
        for row in averaged()
        if (members := [one for one in differences if one.quantity == row.name])
    ]
    caption = "Differences of means with U (95 %). Across zero, both sessions agree."
    return Chart("Differences of means", caption, panels, results.simulated)


def _difference_panel(row: Measurand, members: Sequence[MeanDifference]) -> Panel:
    places = [-float(number) for number in range(len(members))]
    names = [", ".join(filter(None, [each.session, _runs(each)])) for each in members]
    limits = places[-1] - 0.6, 0.6
    values = [each.value.value * row.fine_scale for each in members]
    widths = [each.value.expanded * row.fine_scale for each in members]
    zero = Trace("", (0.0, 0.0), limits, "line", MUTED)
    points = Trace("", values, places, "mean", MODEL, widths, across=True)
    return Panel(
        PlotAxis(f"difference of {row.title} {row.symbol} ± U ({row.fine})"),
        PlotAxis("", dict(zip(places, names, strict=True)), limits),
        [zero, points],
        16.0 * (len(members) + 0.5),
    )


def _runs(mean: MeanDifference | Incline) -> str:
    """Say of which runs a mean or a difference is, where a session has several kinds."""
    names = mean.means if isinstance(mean, Incline) else [mean.quantity]
    return "" if acceleration_in(names) else str(mean.condition)


def _tables(results: TogetherResults) -> Iterator[Part]:
    """Yield the tables of each measurand."""
    differences = results.differences()
    for row in averaged():
        if means := _means(results, row):
            yield Part(f"Means of {row.symbol}", (), _mean_columns(row), means)
        if members := [one for one in differences if one.quantity == row.name]:
            yield Part(f"Differences of {row.symbol}", (), _difference_columns(row), members)


def _less(results: TogetherResults) -> str:
    return _LESS.format(reference=results.fit.parts[0].name)


def _means(results: TogetherResults, row: Measurand) -> list[tuple[str, Incline]]:
    """Means of a measurand: the session's name, and the line of its summary."""
    return [
        (part.name, line)
        for part in results.fit.parts
        for line in part.analysis.summary
        if row.name in line.means
    ]


def _mean_columns(row: Measurand) -> list[Column[tuple[str, Incline]]]:
    return [
        Column("session", lambda one: one[0], numeric=False),
        Column("runs", lambda one: _runs(one[1]), numeric=False),
        Column("n", lambda one: str(one[1].n)),
        Column(
            f"{row.symbol} ± U ({row.unit})",
            lambda one: plus_minus(one[1].means[row.name], row.scale, row.decimals),
        ),
    ]


def _difference_columns(row: Measurand) -> list[Column[MeanDifference]]:
    return [
        Column("session", lambda one: one.session, numeric=False),
        Column("less", lambda one: one.reference, numeric=False),
        Column("runs", _runs, numeric=False),
        Column(
            f"difference of {row.symbol} ± U ({row.fine})",
            lambda one: plus_minus(one.value, row.fine_scale, row.fine_decimals),
        ),
        Column("Eₙ", lambda one: fixed(one.value.normalized_error, 2)),
        Column("means", lambda one: verdict_on(one.value.normalized_error), numeric=False),
    ]
