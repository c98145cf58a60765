"""Figures as files: the same figure gives the same bytes."""

from __future__ import annotations

import io
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from rig.ctrl_c import ctrl_c_waits
from rig.files import make_folder, write_atomic
from rig.report.figure import csv_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.figure import Figure

    from rig.report.figure import Chart

Kind = Literal["svg", "png", "pdf"]
KINDS: tuple[Kind, ...] = get_args(Kind)
ENDINGS = tuple(f".{kind}" for kind in KINDS)
_UNSAID: dict[Kind, tuple[str, ...]] = {
    "svg": ("Date", "Creator", "Format", "Type"),
    "png": ("Software",),
    "pdf": ("Creator", "Producer", "CreationDate"),
}


@contextmanager
def style() -> Iterator[None]:
    """Apply the common style of figures inside the block, and defer Ctrl-C."""
    import matplotlib as mpl  # noqa: PLC0415 - half a second that a headless run never pays

    with ctrl_c_waits(), mpl.rc_context(fname=Path(__file__).with_suffix(".mplstyle")):
        yield


def drawing_file(drawing: Figure, kind: Kind, description: str = "") -> bytes:
    """Return a matplotlib figure as a file; the same figure gives the same bytes.

    Parameters
    ----------
    description
        Description for the file's metadata.
    """
    written = io.BytesIO()
    metadata: dict[str, Any] = dict.fromkeys(_UNSAID[kind])
    metadata["Subject" if kind == "pdf" else "Description"] = description
    with style():
        drawing.savefig(written, format=kind, metadata=metadata)
    return written.getvalue()


def figure_file(figure: Chart, kind: Kind) -> bytes:
    """Return a figure as a file of a kind."""
    from rig.report.plot import plot  # noqa: PLC0415 - half a second, only for figures

    return drawing_file(plot(figure), kind, figure.facts or figure.title)


def write_figure(path: Path, figure: Chart) -> None:
    """Write a figure in the format of the file's suffix (default SVG), completely or not at all.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    kind = next((kind for kind in KINDS if path.suffix == f".{kind}"), KINDS[0])
    write_atomic(path, figure_file(figure, kind))


def write_figures(folder: str | Path, figures: Sequence[Chart]) -> None:
    """Write each figure as ``figure-1.svg``, ``.pdf``, ``.png`` and its numbers as ``.csv``."""
    place = make_folder(folder)
    for number, figure in enumerate(figures, 1):
        path = place / f"figure-{number}.csv"
        write_atomic(path, csv_table(figure))
        for kind in KINDS:
            write_figure(path.with_suffix(f".{kind}"), figure)
