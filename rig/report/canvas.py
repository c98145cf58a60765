"""The look all figures share, and matplotlib figures as SVG text that never changes by itself."""

from __future__ import annotations

import io
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal, get_args

from rig.ctrl_c import ctrl_c_waits
from rig.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

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

Kind = Literal["svg", "png", "pdf"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_DPI = 200  # of PNG files: sharp in a column of a journal

SIZE = 9.0
"""Points, of all type in a figure."""

CAPTION: Mapping[str, Any] = {"y": 0.0, "va": "bottom", "parse_math": False, "line": 0.19}
"""Of a text below all panels; a title may have a $."""
PASSES: Mapping[str, Any] = {"in_layout": False}
"""It may pass under the next panel."""

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
    "figure.titlesize": SIZE,
    "figure.titleweight": "bold",
    "figure.facecolor": PAPER,  # a ground of its own: viewers may be dark
    "axes.facecolor": PAPER,
    "font.family": "DejaVu Sans",  # ships with matplotlib: the same everywhere
    "font.size": SIZE,
    "grid.color": RULE,
    "grid.linewidth": 0.6,
    "axes.titlesize": SIZE,
    "legend.edgecolor": "none",
    "legend.facecolor": PAPER,
    "legend.fancybox": False,
    "legend.framealpha": 0.9,
    "lines.linewidth": 1.6,
    "pdf.fonttype": 42,  # text that can be searched, as journals ask for
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

    def __init__(self, figure: Figure, axes: list[Axes], description: str | None) -> None:
        self.figure = figure
        self.axes = axes
        self._description = description

    @property
    def svg(self) -> str:
        """The figure as SVG, the same each time."""
        return self.file("svg").decode("utf-8")

    def file(self, kind: Kind) -> bytes:
        """Return the figure as a file of a kind; the same drawing gives the same bytes."""
        import matplotlib as mpl  # noqa: PLC0415 - as in `canvas`
        from matplotlib.backends.backend_svg import FigureCanvasSVG  # noqa: PLC0415

        made = io.BytesIO()
        with ctrl_c_waits(), mpl.rc_context(_STYLE):
            if kind == "svg":
                # `savefig` would go through all that is drawn once more, only for the layout.
                drawn: Any = FigureCanvasSVG(self.figure)
                self.figure.set_dpi(_DPI)  # of pixels in it
                drawn.print_svg(made, metadata=self._metadata(kind))
            else:
                self.figure.savefig(made, format=kind, dpi=_DPI, metadata=self._metadata(kind))
        return made.getvalue()

    def _metadata(self, kind: Kind) -> dict[str, Any]:
        if kind == "png":
            return {"Software": None, "Description": self._description or ""}
        if kind == "pdf":
            return {
                "Creator": None, "Producer": None, "CreationDate": None,
                "Subject": self._description,
            }  # fmt: skip
        unsaid = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        return {**unsaid, "Description": self._description}


def kind_of(path: Path) -> Kind:
    """Tell by a file's ending how a figure is to be written.

    Raises
    ------
    InputError
        It is none of those that there are.
    """
    kind = path.suffix.removeprefix(".")
    if kind not in KINDS:
        raise InputError(
            f"{path}: unknown figure format; accepted: {', '.join(f'.{kind}' for kind in KINDS)}",
            f"for example {path.with_suffix('.svg')}",
        )
    return kind


def annotate(
    axes: Axes, words: str, at: tuple[float, float], points: tuple[float, float], **look: Any
) -> None:
    """Write words so many points from a place, which is in data unless `look` has ``xycoords``."""
    axes.annotate(words, at, points, textcoords="offset points", **look)


@contextmanager
def canvas(
    heights: tuple[float, ...],
    width_in: float = 7.0,
    *,
    simulated: bool,
    columns: int = 1,
    sharex: bool = True,
    description: str | None = None,
    caption: str = "",
    caption_look: Mapping[str, Any] = CAPTION,
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
    caption
        Written below the panels, in lines as they are.
    caption_look
        How: properties of the text, with the vertical place ``y`` and the ``line`` height, inches.
    """
    import matplotlib as mpl  # noqa: PLC0415 - half a second that a headless run never pays
    from matplotlib.figure import Figure  # noqa: PLC0415

    with ctrl_c_waits(), mpl.rc_context(_STYLE):
        look = dict(caption_look)
        line = look.pop("line")
        heights += (line * (caption.count("\n") + 2),) if caption else ()
        figure = Figure(figsize=(width_in, sum(heights)), layout="constrained")
        panels = figure.subplots(
            len(heights), columns, sharex=sharex, squeeze=False, height_ratios=list(heights)
        )
        shown, foot = (panels[:-1], panels[-1]) if caption else (panels, [])
        drawing = Canvas(figure, list(shown.flat), description)
        yield drawing
        for panel in foot:
            panel.axis("off")
        if caption:
            foot[0].text(0.0, look.pop("y"), caption, transform=foot[0].transAxes, **look)
            for panel in shown[-1] if sharex else ():
                panel.tick_params(labelbottom=True)  # which its panel below would take
        figure.align_ylabels(panels.flat)
        if simulated:
            # In a strip of its own, where it hides nothing and nothing hides it.
            figure.suptitle("SIMULATED DATA", x=0.995, ha="right", color=SECOND)
