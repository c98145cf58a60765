"""The look all figures share, and matplotlib figures as SVG text that never changes by itself."""

from __future__ import annotations

import io
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#1f2328"
MUTED = "#66707b"
RULE = "#d5dae0"
PAPER = "#fefefe"
MODEL = "#0072b2"
MODEL_BAND = "#cce3f0"
SECOND = "#d55e00"
"""Blue and vermilion of Okabe and Ito's palette; shapes and words say the same once more."""

_STYLE: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "errorbar.capsize": 2.5,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "font.family": "DejaVu Sans",  # ships with matplotlib: the same everywhere
    "font.size": 9.0,
    "grid.color": RULE,
    "grid.linewidth": 0.6,
    "legend.fontsize": 8.0,
    "legend.edgecolor": "none",
    "legend.facecolor": PAPER,
    "legend.fancybox": False,
    "legend.framealpha": 0.9,
    "lines.linewidth": 1.6,
    "svg.fonttype": "path",
    "svg.hashsalt": "rig",  # without it every run would give other ids
    "text.color": INK,
    "xtick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.color": MUTED,
    "ytick.labelcolor": INK,
}


class Canvas:
    """A figure being drawn inside `canvas`.

    Attributes
    ----------
    axes
        The panels row by row.
    svg
        The text, once the block has ended.
    """

    def __init__(self, figure: Figure, axes: list[Axes]) -> None:
        self.figure = figure
        self.axes = axes
        self.svg = ""


@contextmanager
def canvas(
    heights: tuple[float, ...],
    width_in: float = 7.0,
    *,
    simulated: bool,
    columns: int = 1,
    sharex: bool = True,
    description: str | None = None,
) -> Iterator[Canvas]:
    """Set the style up, hand out empty panels, and make the SVG text at the end.

    Parameters
    ----------
    heights
        Of the panels, inches.
    width_in
        Of the figure, inches.
    simulated
        Whether to stamp the figure.
    columns
        Panels side by side in each row.
    sharex
        Whether all panels have one horizontal axis.
    description
        Kept in the file's metadata, where programs find it.
    """
    import matplotlib as mpl  # noqa: PLC0415 - half a second that a headless run never pays
    from matplotlib.figure import Figure  # noqa: PLC0415

    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(width_in, sum(heights)), layout="constrained")
        panels = figure.subplots(
            len(heights), columns, sharex=sharex, squeeze=False, height_ratios=list(heights)
        )
        drawing = Canvas(figure, list(panels.flat))
        yield drawing
        figure.align_ylabels(drawing.axes)
        if simulated:
            _stamp(figure)
        text = io.StringIO()
        metadata: dict[str, Any] = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        metadata["Description"] = description
        figure.savefig(text, format="svg", metadata=metadata)
        drawing.svg = text.getvalue()


def _stamp(figure: Figure) -> None:
    figure.text(
        0.53,
        0.5,
        "SIMULATED DATA",
        rotation=24,
        fontsize=38,
        fontweight="bold",
        color=INK,
        alpha=0.09,
        ha="center",
        va="center",
        zorder=10,
    )
