"""Figures as files: the same figure gives the same bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.ctrl_c import ctrl_c_waits
from rig.files import make_folder, replacing
from rig.report.canvas import KINDS, Canvas, kind_of
from rig.report.figure import Chart, csv_table
from rig.report.layout import lay_out
from rig.report.looks import COLORS, FONT, LOOKS, SIZE
from rig.report.svg import figure_svg

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rig.report.canvas import Kind
    from rig.report.layout import PlacedFigure

_ANCHORS: dict[str, Any] = {"start": "left", "middle": "center", "end": "right"}


def write_figure(path: Path, drawing: Canvas | Chart) -> None:
    """Write a figure as its file's ending says, whole or not at all.

    Raises
    ------
    InputError
        If it says nothing, or the file cannot be written.
    """
    kind = kind_of(path)
    content = figure_file(drawing, kind) if isinstance(drawing, Chart) else drawing.file(kind)
    with replacing(path) as stream:
        stream.write(content)


def figure_file(figure: Chart, kind: Kind) -> bytes:
    """Return a figure, one column of a journal wide, as a file of a kind."""
    drawing = lay_out(figure)
    if kind == "svg":
        return figure_svg(drawing, figure.title).encode()
    return _plotted(drawing, figure.title).file(kind)


def write_figures(folder: Path, figures: Sequence[Chart]) -> None:
    """Write each figure as ``figure-1.svg``, ``.pdf``, ``.png`` and its numbers as ``.csv``."""
    make_folder(folder)
    for number, figure in enumerate(figures, 1):
        path = folder / f"figure-{number}.csv"
        with replacing(path) as stream:
            stream.write(csv_table(figure).encode())
        for kind in KINDS:
            write_figure(path.with_suffix(f".{kind}"), figure)


def _plotted(drawing: PlacedFigure, title: str) -> Canvas:
    """Let matplotlib draw what is laid out, for the kinds of file that it can write."""
    from matplotlib.figure import Figure as MplFigure  # noqa: PLC0415 - half a second, only for files
    from matplotlib.patches import PathPatch  # noqa: PLC0415
    from matplotlib.path import Path as Outline  # noqa: PLC0415

    with ctrl_c_waits():
        plot = MplFigure(figsize=(drawing.width / 72.0, drawing.height / 72.0))
        axes = plot.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        axes.set_xlim(0.0, drawing.width)
        axes.set_ylim(drawing.height, 0.0)
        for path in drawing.paths:
            look, color = LOOKS[path.look], COLORS[path.color][0]
            style: dict[str, Any] = {"facecolor": color, "edgecolor": "none"}
            if look.width:
                dash = (0.0, look.dash) if look.dash else "-"
                cap = {"square": "projecting"}.get(look.cap, look.cap)
                style = {"edgecolor": color, "facecolor": "none", "linewidth": look.width,
                         "linestyle": dash, "capstyle": cap}  # fmt: skip
            for line in path.lines:
                # A dot is a line of no length, which matplotlib would not draw.
                ends = [*line, line[0] if not look.width else (line[-1][0] + 1e-3, line[-1][1])]
                outline = Outline(ends, closed=not look.width)
                axes.add_patch(PathPatch(outline, alpha=look.opacity, **style))
        for x, y, words, anchor, shade, turned in drawing.texts:
            axes.text(x, y, words, ha=_ANCHORS[anchor], va="baseline", fontsize=SIZE, family=FONT,
                      color=COLORS[shade][0], rotation=90.0 if turned else 0.0,
                      rotation_mode="anchor", parse_math=False)  # fmt: skip
    return Canvas(plot, [], title)
