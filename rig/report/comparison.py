"""Sessions beside each other: tables, a figure and a page of their differences."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.measurands import averaged
from rig.report.canvas import INK, MODEL, MUTED, canvas
from rig.report.chapters import Chapter
from rig.report.columns import Column, aligned, summary_table, verdict_on
from rig.report.embed import PageFigure, embedded
from rig.report.html import page_html
from rig.report.numbers import fixed, plus_minus
from rig.report.tables import bullets, paragraphs, table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.analysis.summary import Incline
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
    caption = "Means of each session with U (95 %)."
    figure = embedded(PageFigure(drawing.svg, "Means of each session", caption), 1)
    lead = paragraphs([_less(results)], "lead") + bullets(shared_lines(results))
    tables = "".join(table(*one) for one in _tables(results))
    chapters = [Chapter("short", "Summary", lead), Chapter("results", "Results", figure + tables)]
    return page_html(title, chapters, simulated=results.simulated)


def draw_comparison(results: TogetherResults) -> Canvas:
    """Draw the means of all sessions, a panel for each measurand, a row for each mean."""
    rows = [row for row in averaged() if _means(results, row)]
    names = [part.name for part in results.fit.parts]
    height = 0.6 + 0.28 * max(len(_means(results, row)) for row in rows)
    with canvas((height,) * len(rows), simulated=results.simulated, sharex=False) as drawing:
        for row, axes in zip(rows, drawing.axes, strict=True):
            means = _means(results, row)
            for place, (name, line) in enumerate(means):
                value = line.means[row.name]
                axes.errorbar(
                    value.value * row.scale,
                    -place,
                    xerr=value.expanded * row.scale,
                    fmt="o",
                    color=MODEL if name == names[0] else INK,
                    markersize=4.2,
                )
            axes.set_yticks([-n for n in range(len(means))], [_label(*one) for one in means])
            axes.set_xlabel(row.axis)
            axes.margins(y=0.5 / len(means))
            axes.grid(visible=True, axis="x")
            axes.tick_params(axis="y", labelcolor=MUTED)
    return drawing


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


def _label(name: str, line: Incline) -> str:
    return f"{name}{_where(line)}"


def _where(line: Incline) -> str:
    """Say of which runs a mean is, where a session has several kinds."""
    return "" if "gravity_m_s2" in line.means else f", {line.condition}"


def _mean_columns(row: Measurand) -> list[Column[tuple[str, Incline]]]:
    return [
        Column("session", lambda one: one[0], numeric=False),
        Column("runs", lambda one: _where(one[1]).removeprefix(", "), numeric=False),
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
        Column("runs", lambda one: str(one.condition), numeric=False),
        Column(
            f"difference of {row.symbol} ± U ({row.fine})",
            lambda one: plus_minus(one.value, row.fine_scale, row.fine_decimals),
        ),
        Column("Eₙ", lambda one: fixed(one.value.normalized_error, 2)),
        Column("means", lambda one: verdict_on(one.value.normalized_error), numeric=False),
    ]
