"""Figures as files: the same figure gives the same bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.files import make_folder, replacing
from rig.report.canvas import KINDS, kind_of
from rig.report.figure import csv_table

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rig.report.canvas import Kind
    from rig.report.figure import Chart


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


def write_figures(folder: Path, figures: Sequence[Chart]) -> None:
    """Write each figure as ``figure-1.svg``, ``.pdf``, ``.png`` and its numbers as ``.csv``."""
    make_folder(folder)
    for number, figure in enumerate(figures, 1):
        path = folder / f"figure-{number}.csv"
        with replacing(path) as stream:
            stream.write(csv_table(figure).encode())
        for kind in KINDS:
            write_figure(path.with_suffix(f".{kind}"), figure)


def figure_file(figure: Chart, kind: Kind) -> bytes:
    """Return a figure as a file of a kind."""
    from rig.report.plot import plot  # noqa: PLC0415 - half a second, only for figures

    return plot(figure).file(kind)
