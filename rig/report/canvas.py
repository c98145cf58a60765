"""Figures as files: the same figure gives the same bytes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from rig.files import make_folder, write_atomic
from rig.report.figure import Chart, csv_table

Kind = Literal["svg", "png", "pdf"]
KINDS: tuple[Kind, ...] = get_args(Kind)
ENDINGS = tuple(f".{kind}" for kind in KINDS)


def figure_file(figure: Chart, kind: Kind) -> bytes:
    """Return a figure as a file of a kind."""
    from rig.report.plot import drawing_file, plot  # noqa: PLC0415 - half a second, only for figures

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
