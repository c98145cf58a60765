"""The paper's figures, drawn anew from its equations."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rig.measurands import SEPARATION, SPEED
from rig.model import paper
from rig.report.figure import chart

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rig.report.figure import Chart

    Columns = Mapping[str, list[float]]

_NO_LINE = "No line from just above 0° to arctan μ = 11.3°: the rods would not slide there."


def paper_figure(
    number: int, resolved: Columns | None = None
) -> tuple[Chart, dict[str, list[float]]]:
    """Draw one of the paper's figures.

    Parameters
    ----------
    number
        3 (Δz and V against inclination), 4 (height against V²) or 6 (against rod inertia).
    resolved
        What falls in the resolved world give for it, to be drawn too; see
        `rig.bench.resolved_paper`. Of figures 3 and 4 only.

    Returns
    -------
    figure, columns
        The figure, with what the text says of it and the equations do not below it; and its
        numbers.
    """
    columns = getattr(paper, f"figure_{number}")()
    foot = [
        *([_NO_LINE] if number == 3 else []),
        "Where the paper's text and its equations differ:",
        *(f"· {text}; equations: {value}" for text, value in paper.claims()[number].items()),
    ]
    figure = chart(f"paper {number}", *_SOURCES[number](columns, resolved or {}))
    return replace(figure, caption=figure.title, foot=foot), columns


def _figure_3(model: Columns, resolved: Columns) -> Iterator[dict[str, Any]]:
    """Δz above, V below; of resolved falls the means with their standard deviations."""
    rows = [dict(zip(model, row, strict=True)) for row in zip(*model.values(), strict=True)]
    surface = [row for row in rows if not row["pile"]]
    # The rods do not slide between level and arctan μ: no line across.
    start = surface[0]["incline_deg"] == 0.0
    for row in (SEPARATION, SPEED):
        yield {
            "row": row,
            "level": surface[:start],
            "surface": surface[start:],
            "pile": [row for row in rows if row["pile"]],
            "resolved": resolved,
            "falls": max(resolved.get("falls", ()), default=0),
            "sd": row.key("sd"),
            "in_text": paper.TEXT_FREE_FALL_SPEED,
            "texts": [paper.TEXT_FREE_FALL_SPEED] * (row == SPEED),
            "speeds": [paper.FREE_FALL_SPEED] * (row == SPEED),
        }


def _figure_4(model: Columns, resolved: Columns) -> Iterator[dict[str, Any]]:
    """Height against V², with the separation at the end; the paper's own point is hollow."""
    measured = [(model["free_speed2"][-1], paper.MEASURED_GRADED_SEPARATION)]
    yield {"model": model, "measured": measured, "resolved": resolved}


def _figure_6(model: Columns, _: Columns) -> Iterator[dict[str, Any]]:
    """Against ξ, with the closed forms beside the discrete model."""
    for row, number in ((SEPARATION, 15), (SPEED, 14)):
        yield {"row": row, "number": number, "model": model}


_SOURCES: dict[int, Any] = {3: _figure_3, 4: _figure_4, 6: _figure_6}
