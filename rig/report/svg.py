"""A laid out figure as SVG: with classes inside a page, with its own colours in a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.report import looks
from rig.report.templates import render

if TYPE_CHECKING:
    from rig.report.layout import Path, PlacedFigure, Point


def figure_svg(drawing: PlacedFigure, title: str, kind: str = "") -> str:
    """Return SVG of a further class for a page, or without one for a file."""
    paths = [(path, _data(path)) for path in drawing.paths if path.lines]
    return render("figure.svg", drawing=drawing, title=title, kind=kind, paths=paths, looks=looks)


def _data(path: Path) -> str:
    """Write lines as path data; a dot is a line of no length, an area is closed."""
    close = "" if looks.LOOKS[path.look].width else "z"
    return "".join(_line(line) + close for line in path.lines)


def _line(line: list[Point]) -> str:
    """Write tenths of a point, each place from the one before, without repeats."""
    (x, y), *rest = [(round(10 * x), round(10 * y)) for x, y in line]
    data, letter = f"M{x / 10:g} {y / 10:g}", "l"
    for after_x, after_y in rest:
        if (after_x, after_y) != (x, y):
            data += f"{letter}{(after_x - x) / 10:g} {(after_y - y) / 10:g}"
            x, y, letter = after_x, after_y, " "
    return data if letter == " " else f"{data}h0"
