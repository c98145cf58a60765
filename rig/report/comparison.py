"""Comparison of sessions: tables, a figure and a page of their differences."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from rig.analysis.summary import Incline
from rig.measurands import Measurand, acceleration_in, averaged
from rig.report.columns import Part, table_parts
from rig.report.figure import Chart, chart
from rig.report.parts import means_of, summary_table
from rig.report.templates import lines, page_html, sentence
from rig.results.together import MeanDifference, TogetherResults


def shared_lines(results: TogetherResults) -> list[str]:
    """Return lines about the errors that sessions share."""
    owners = defaultdict[str, list[str]](list)
    for owner, groups in results.shared.items():
        for group in (group for group in groups if len(group) > 1):
            owners[", ".join(group)].append(owner)
    return lines("common", owners)


def pooled_lines(results: TogetherResults) -> Iterator[str]:
    """Yield the means over all sessions of each scene, as lines of text."""
    for names, summary in results.pooled.items():
        yield from [f"{', '.join(names)}:", *summary_table(summary).splitlines()]
    yield from shared_lines(results)


def difference_lines(results: TogetherResults) -> Iterator[str]:
    """Yield the means of every session and their differences, as lines of text."""
    for part in _tables(results):
        yield from ["", *part.table]
    yield from ["", *_claims(results)]


def comparison_page(results: TogetherResults) -> str:
    """Return the page that `rig compare -o` writes."""
    title = f"Comparison with {results.parts[0].name}"
    page = {"template": "comparison.html", "title": title, "simulated": results.simulated}
    page |= {"chart": draw_comparison(results), "tables": [*_tables(results)]}
    return page_html({**page, "claims": _claims(results)})[0]


def draw_comparison(results: TogetherResults) -> Chart:
    """Return all differences with U (95 %), a panel for each measurand, zero as a line."""
    panels = (_panel(row, differences) for row, differences in _differences(results) if differences)
    return replace(chart("differences", *panels), simulated=results.simulated)


def _panel(row: Measurand, differences: Sequence[MeanDifference]) -> dict[str, Any]:
    places = {-float(place): each for place, each in enumerate(differences)}
    names = {at: f"{each.session}, {_runs(each)}".rstrip(", ") for at, each in places.items()}
    limits = min(places) - 0.6, 0.6
    return {
        "row": row,
        "middle": [(0.0, limit) for limit in limits],
        "differences": places.items(),
        "height": 16.0 * (len(places) + 0.5),
        "y_axis": {"names": names, "limits": limits},
    }


def _runs(mean: MeanDifference | Incline) -> str:
    """Return the condition of a mean or difference in words; empty for an acceleration."""
    names = mean.means if isinstance(mean, Incline) else [mean.quantity]
    return "" if acceleration_in(names) else str(mean.condition)


def _differences(results: TogetherResults) -> Iterator[tuple[Measurand, list[MeanDifference]]]:
    for row in averaged():
        yield row, [each for each in results.differences() if each.quantity == row.name]


def _tables(results: TogetherResults) -> Iterator[Part]:
    """Yield the tables of each measurand."""
    for row, differences in _differences(results):
        means = (
            {"session": part.name, "line": mean.line}
            for part in results.parts
            for mean in means_of(part.analysis.summary, row)
        )
        for name, records in (("sessions", means), ("differences", differences)):
            yield from table_parts(name, records, (), {"runs": _runs}, row)


def _claims(results: TogetherResults) -> list[str]:
    return [sentence("less", results.parts[0].name), *shared_lines(results)]
