"""A figure as plain data: what is drawn, and not how.

Whoever draws it (`rig.report.plot` for pages and files) or writes it (`csv_table`) adds nothing
to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rig.report.columns import read_tables
from rig.report.looks import INK, MODEL
from rig.text_table import csv_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from rig.analysis.result import Measured

    Values = Sequence[float] | NDArray[np.float64]

Role = Literal[
    "line",
    "dash",
    "thick",
    "band",
    "level",
    "limit",
    "gap",
    "shade",
    "points",
    "mean",
    "ring",
    "square",
    "cross",
    "bar",
    "words",
    "map",
    "levels",
]
"""How a series looks.

A `line`, `dash` or `thick` line joins its points, with a gap where one is not a number; a `band`
fills y ± u; a `level` or `limit` is a line across the panel at
each y; a `shade` fills the panel between two y, a `gap` between two x; `points` are small, `mean`,
`ring` and `square` large, with bars of u; a `cross` does not set the scale; a `bar` lies from
`base` to x; `words` are only the label, outwards from the point; a `map` shades the grid of x
and y by z, in steps at the levels u, and `levels` are numbered lines there.
"""


COLUMN_PT, WIDE_PT = 244.0, 400.0
"""A journal's column of 86 mm, which is a telephone's width too, and the width of a page."""
_WORDS = dict(read_tables(Path(__file__).with_name("figures.txt").read_text("utf-8")))
_FEW = 40  # points that are drawn large
_COLUMNS = ("panel", "x_axis", "y_axis", "series", "x", "y", "U95", "begins")


@dataclass(frozen=True, slots=True)
class Trace:
    """What is drawn in one way.

    Attributes
    ----------
    label
        Written beside it; empty writes nothing.
    x, y
        In units of the axes.
    role
        See `Role`.
    u
        Half-widths along y, or along x where `across`.
    base
        Where each bar begins.
    z
        Of a grid, row by row.
    color
        A place in `rig.report.looks.COLORS`.
    """

    label: str
    x: Sequence[float]
    y: Sequence[float]
    role: Role
    color: int = 0
    u: Sequence[float] = ()
    base: Sequence[float] = ()
    across: bool = False
    z: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class PlotAxis:
    """An axis: its label with the unit, names in place of numbers, limits, whole numbers only."""

    label: str
    names: Mapping[float, str] = field(default_factory=dict)
    limits: tuple[float, float] | None = None
    whole: bool = False


@dataclass(frozen=True, slots=True)
class Panel:
    """Series on two axes, so many points high; neighbours with equal x axes share one.

    Where the panel is `true`, a unit is as long on both axes.
    """

    x: PlotAxis
    y: PlotAxis
    series: Sequence[Trace]
    height: float = 120.0
    true: bool = False


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels above each other.

    Attributes
    ----------
    title
        What is shown, for who hears the page.
    caption
        One line below the figure.
    simulated
        Whether to stamp it.
    foot
        Lines below the panels, for a figure that stands alone.
    width
        As a file, points.
    facts
        For programs, in the file's metadata.
    """

    title: str
    caption: str
    panels: Sequence[Panel]
    simulated: bool = False
    foot: Sequence[str] = ()
    width: float = COLUMN_PT
    facts: str = ""


def chart(name: str, panels: Sequence[Panel], **values: object) -> Chart:
    """Return a figure with its title and caption in ``figures.txt``."""
    heading, caption, _ = _WORDS[name]
    return Chart(heading.format(**values), caption.format(**values), panels)


def series(
    label: str,
    x: Values,
    y: Values,
    role: Role,
    color: int = INK,
    u: Values = (),
    scale: float = 1.0,
    **options: Any,
) -> Trace:
    """Return a `Trace` of any numbers, y and u times a factor."""
    x, y, u = [*map(float, x)], [scale * float(value) for value in y], [*map(float, u)]
    return Trace(label, x, y, role, color, [scale * value for value in u], **options)


def measured(
    label: str,
    points: Iterable[tuple[float, Measured]],
    role: Role,
    color: int = INK,
    scale: float = 1.0,
    *,
    across: bool = False,
) -> Trace:
    """Return a `Trace` of measured values at their places, large points with bars of U."""
    rows = [(place, scale * value.value, scale * value.expanded) for place, value in points]
    places, values, widths = map(list, zip(*rows, strict=True)) if rows else ([], [], [])
    x, y = (values, places) if across else (places, values)
    return Trace(
        label, x, y, role, color, () if role in {"points", "cross"} else widths, (), across
    )


def residual_panels(x: PlotAxis, ratios: Iterable[tuple[float, float]]) -> list[Panel]:
    """Return the panel below a curve: what is left over in units of U, ±1 shaded.

    Parameters
    ----------
    ratios
        Each at its place; those that are no numbers are left out, for there is no U.

    Returns
    -------
    list of Panel
        None where there is nothing to show.
    """
    rows = [(float(place), float(ratio)) for place, ratio in ratios if math.isfinite(ratio)]
    if not rows:
        return []
    places, values = zip(*rows, strict=True)
    most = 1.1 * max(2.0, *map(abs, values))
    lines = [
        Trace("", (), (-1.0, 1.0), "shade", MODEL),
        Trace("", (), (0.0,), "level", MODEL),
        series("", places, values, "mean" if len(rows) <= _FEW else "points"),
    ]
    return [Panel(x, PlotAxis("residual\n/ U", limits=(-most, most)), lines, 42.0)]


def csv_table(figure: Chart) -> str:
    """Write all numbers of a figure as CSV, a row a point."""
    rows = [
        [number, panel.x.label, panel.y.label, series.label or series.role, *point]
        for number, panel in enumerate(figure.panels, 1)
        for series in panel.series
        for point in zip_longest(series.x, series.y, series.u, series.base)
    ]
    return csv_text(_COLUMNS, [dict(zip(_COLUMNS, row, strict=True)) for row in rows])
