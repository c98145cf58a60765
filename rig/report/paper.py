"""The paper's figures, computed from its equations."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from rig.measurands import SEPARATION, SPEED
from rig.model import paper
from rig.report.figure import Chart, chart

Columns = Mapping[str, list[float]]

_NO_LINE = "No line from just above 0° to arctan μ = 11.3°: the rods would not slide there."


def paper_figure(
    number: int, resolved: Columns | None = None
) -> tuple[Chart, dict[str, list[float]]]:
    """Return a figure of the paper, and its numbers.

    Parameters
    ----------
    number
        3 (Δz and V against inclination), 4 (height against V²) or 6 (against rod inertia).
    resolved
        Results of falls in the resolved world to be drawn as well; only for figures 3 and 4.

    Returns
    -------
    figure, columns
        The figure, with claims of the text that differ from the equations below; and its numbers.
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
    """Yield Δz above, V below; for resolved falls the means with standard deviations."""
    rows = [dict(zip(model, row, strict=True)) for row in zip(*model.values(), strict=True)]
    surface = [row for row in rows if not row["pile"]]
    # Rods do not slide between 0° and arctan μ: the curve has a gap there.
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
    """Yield height against V², with the final separation; the paper's point is hollow."""
    measured = [(model["free_speed2"][-1], paper.MEASURED_GRADED_SEPARATION)]
    yield {"model": model, "measured": measured, "resolved": resolved}


def _figure_6(model: Columns, _: Columns) -> Iterator[dict[str, Any]]:
    """Yield Δz and V against ξ, with the closed forms and the discrete model."""
    for row, number in ((SEPARATION, 15), (SPEED, 14)):
        yield {"row": row, "number": number, "model": model}


_SOURCES: dict[int, Any] = {3: _figure_3, 4: _figure_4, 6: _figure_6}
