"""Sessions beside each other: tables, a figure and a page of their differences."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.analysis.summary import Incline
from rig.measurands import acceleration_in, averaged
from rig.report.canvas import MODEL, MUTED, canvas
from rig.report.chapters import Chapter
from rig.report.columns import Column, aligned, summary_table, verdict_on
from rig.report.embed import PageFigure, embedded
from rig.report.html import page_html
from rig.report.numbers import fixed, plus_minus
from rig.report.tables import bullets, paragraphs, table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.measurands import Measurand
    from rig.report.canvas import Canvas
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
    for _, columns, records in _tables(results):
        yield from ["", *aligned(columns, records)]
    yield from ["", _less(results), *shared_lines(results)]


def comparison_page(results: TogetherResults) -> str:
    """Return the page that `rig compare -o` writes."""
    title = f"Comparison with {results.fit.parts[0].name}"
    drawing = draw_comparison(results)
    caption = "Differences of means with U (95 %). Across zero, both sessions agree."
    figure = embedded(PageFigure(drawing.svg, "Differences of means", caption), 1)
    lead = paragraphs([_less(results)], "lead") + bullets(shared_lines(results))
    tables = "".join(table(*one) for one in _tables(results))
    chapters = [Chapter("short", "Summary", lead), Chapter("results", "Results", figure + tables)]
    return page_html(title, chapters, simulated=results.simulated)


def draw_comparison(results: TogetherResults) -> Canvas:
    """Draw all differences with U (95 %), a panel for each measurand, zero as a line."""
    differences = results.differences()
    panels = [
        (row, members)
        for row in averaged()
        if (members := [one for one in differences if one.quantity == row.name])
    ]
    heights = tuple(0.7 + 0.25 * len(members) for _, members in panels)
    with canvas(heights, simulated=results.simulated, sharex=False) as drawing:
        for (row, members), axes in zip(panels, drawing.axes, strict=True):
            axes.axvline(0.0, color=MUTED, linewidth=1.0)
            axes.errorbar(
                [one.value.value * row.fine_scale for one in members],
                range(len(members)),
                xerr=[one.value.expanded * row.fine_scale for one in members],
                fmt="o",
                color=MODEL,
                markersize=4.2,
            )
            names = [", ".join(filter(None, [one.session, _runs(one)])) for one in members]
            axes.set_yticks(range(len(members)), names)
            axes.set_ylim(len(members) - 0.5, -0.5)
            axes.set_xlabel(f"difference of {row.title} {row.symbol} ± U ({row.fine})")
    return drawing


def _runs(mean: MeanDifference | Incline) -> str:
    """Say of which runs a mean or a difference is, where a session has several kinds."""
    names = mean.means if isinstance(mean, Incline) else [mean.quantity]
    return "" if acceleration_in(names) else str(mean.condition)


def _tables(
    results: TogetherResults,
) -> Iterator[tuple[str, Sequence[Column[Any]], Sequence[Any]]]:
    """Yield name, columns and records of the tables of each measurand."""
    differences = results.differences()
    for row in averaged():
        if means := _means(results, row):
            yield f"Means of {row.symbol}", _mean_columns(row), means
        if members := [one for one in differences if one.quantity == row.name]:
            yield f"Differences of {row.symbol}", _difference_columns(row), members


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
