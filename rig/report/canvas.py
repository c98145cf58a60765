"""Figures as files: the same figure gives the same bytes."""

from __future__ import annotations

import io
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from rig.ctrl_c import ctrl_c_waits
from rig.errors import InputError
from rig.files import make_folder, replacing
from rig.report import looks
from rig.report.figure import csv_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rig.report.figure import Chart

INK, MODEL, SECOND, MUTED, PAPER = (
    looks.COLORS[number][0]
    for number in (looks.INK, looks.MODEL, looks.SECOND, looks.MUTED, looks.PAPER)
)

Kind = Literal["svg", "png", "pdf"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_UNSAID: dict[Kind, tuple[str, ...]] = {
    "svg": ("Date", "Creator", "Format", "Type"),
    "png": ("Software",),
    "pdf": ("Creator", "Producer", "CreationDate"),
}
_SAID = {"pdf": "Subject"}
STYLE = Path(__file__).with_suffix(".mplstyle")


@dataclass(frozen=True, slots=True)
class Canvas:
    """A figure of matplotlib, its panels row by row, and what it says of itself in its files."""

    figure: Figure
    axes: Sequence[Axes] = ()
    description: str = ""

    @property
    def svg(self) -> str:
        """The figure as SVG, the same each time."""
        return self.file("svg").decode("utf-8")

    def file(self, kind: Kind) -> bytes:
        """Return the figure as a file of a kind; the same drawing gives the same bytes."""
        import matplotlib as mpl  # noqa: PLC0415 - as in `canvas`

        written = io.BytesIO()
        metadata: dict[str, Any] = dict.fromkeys(_UNSAID[kind]) | {
            _SAID.get(kind, "Description"): self.description
        }
        with ctrl_c_waits(), mpl.rc_context(fname=STYLE):
            self.figure.savefig(written, format=kind, metadata=metadata)
        return written.getvalue()


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


@contextmanager
def canvas(
    heights: tuple[float, ...],
    width_in: float = 7.0,
    *,
    columns: int = 1,
    sharex: bool = True,
) -> Iterator[Canvas]:
    """Set the style up, and hand out empty panels.

    Parameters
    ----------
    heights
        Of the panels, inches.
    width_in
        Of the figure, inches.
    columns
        Panels side by side in each row.
    sharex
        Whether all panels have one horizontal axis.
    """
    import matplotlib as mpl  # noqa: PLC0415 - half a second that a headless run never pays
    from matplotlib.figure import Figure  # noqa: PLC0415

    with ctrl_c_waits(), mpl.rc_context(fname=STYLE):
        figure = Figure(figsize=(width_in, sum(heights)), layout="constrained")
        panels = figure.subplots(
            len(heights), columns, sharex=sharex, squeeze=False, height_ratios=list(heights)
        )
        yield Canvas(figure, list(panels.flat))
        figure.align_ylabels(panels.flat)


def write_figure(path: Path, figure: Chart) -> None:
    """Write a figure as its file's ending says, whole or not at all.

    Raises
    ------
    InputError
        If it says nothing, or the file cannot be written.
    """
    content = figure_file(figure, kind_of(path))
    with replacing(path) as stream:
        stream.write(content)


def write_figures(folder: str | Path, figures: Sequence[Chart]) -> None:
    """Write each figure as ``figure-1.svg``, ``.pdf``, ``.png`` and its numbers as ``.csv``."""
    place = make_folder(folder)
    for number, figure in enumerate(figures, 1):
        path = place / f"figure-{number}.csv"
        with replacing(path) as stream:
            stream.write(csv_table(figure).encode())
        for kind in KINDS:
            write_figure(path.with_suffix(f".{kind}"), figure)


def figure_file(figure: Chart, kind: Kind) -> bytes:
    """Return a figure as a file of a kind."""
    from rig.report.plot import plot  # noqa: PLC0415 - half a second, only for figures

    return plot(figure).file(kind)
