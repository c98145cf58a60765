"""``./run bench layouts``."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from bench.studies.figures import layouts_figure
from bench.studies.layout_catalogue import LAYOUTS, chosen
from bench.studies.layouts import DISTURBANCES, DROPS, Cell, as_json, study
from rig.commands.output import leave_study, say
from rig.errors import InputError
from rig.files import make_folder
from rig.measurands import MEASURANDS
from rig.report.columns import Column, filled
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    Record = Mapping[str, Any]

_HEAD = """\
# Which gate layouts can be read

`./run bench layouts --drops {drops}`: {drops} drops on each layout, without disturbances, with
the usual ones, and with all doubled. Left out: drops that truly miss more edges than accepted.

![Map of layouts](layouts.svg)"""


def main(arguments: Namespace) -> int:
    """Drop chains on every layout; keep table, picture and page, and print the table."""
    layouts = chosen(LAYOUTS, arguments.only)
    folder = make_folder(arguments.output)
    before = _found_before(folder / "layouts.json") if arguments.more else []
    found = study(layouts, arguments.drops or DROPS, arguments.jobs, say, before)
    whole = as_json(found)
    cells = whole["layouts"]
    drops = " or ".join(map(str, sorted({cell.drops for cell in found})))
    leave_study(
        folder, "layouts", _HEAD.format(drops=drops), _lines(whole), whole, _csv(cells),
        layouts_figure(cells), as_json=arguments.json,
    )  # fmt: skip
    return 0


def _found_before(file: Path) -> list[Cell]:
    """Read what this bench has left."""
    try:
        return [Cell.read(one) for one in json.loads(file.read_text(encoding="utf-8"))["layouts"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not what this bench leaves"
        raise InputError(
            f"cannot add to {file}: {why}",
            "leave --more out to begin anew; ./run bench layouts writes this file there",
        ) from error


def _csv(cells: Sequence[Record]) -> str:
    """One line a layout and disturbance; what lies deeper is in the JSON."""
    flat = [name for name, value in cells[0].items() if not isinstance(value, dict)]
    return csv_text(flat, cells)


def _lines(whole: Record) -> list[str]:
    """One row a layout, with its disturbances side by side, then what all have together."""
    by_layout: dict[tuple[str, str], list[Record]] = {}
    for cell in whole["layouts"]:
        by_layout.setdefault((cell["chain"], cell["heights_mm"]), []).append(cell)
    rows = [{"of": cells[0], "cells": cells} for cells in by_layout.values()]
    names = " / ".join(DISTURBANCES)
    return [
        f"void, marginal, drops with a wrong rod, error and its ratio to u: {names}",
        *_table(_COLUMNS, rows),
        "",
        *_table(_TOTALS, whole["totals"]),
    ]


def _table(columns: Sequence[Column[Record]], records: Sequence[Record]) -> list[str]:
    """Write records as aligned text; what a line is of begins it."""
    kept, rows = filled(columns, records)
    words = {n for n, column in enumerate(kept) if not column.numeric}
    return text_table([[column.heading for column in kept], *rows], left=words, rule=True)


def _each(text: Callable[[Record], str]) -> Callable[[Record], str]:
    return lambda row: " / ".join(text(cell) for cell in row["cells"])


def _share(name: str) -> Callable[[Record], str]:
    return lambda cell: f"{cell[name]:.0%}"


def _size(cell: Record) -> str:
    """Error in the unit of its measurand: mm, mm/s or mm/s²."""
    return "–" if cell["error_rms"] is None else f"{1e3 * cell['error_rms']:.3g}"


def _symbol(name: str) -> str:
    row = MEASURANDS[name]
    return f"{row.symbol} ({row.fine})"


def _ratio(cell: Record) -> str:
    return "–" if cell["z_rms"] is None else f"{cell['z_rms']:.2g}"


def _times(cell: Record) -> str:
    """Time of a drop over that of one least-squares solution of as many equations."""
    return "–" if cell["times_lstsq"] is None else f"{cell['times_lstsq']:.0f}"


_COLUMNS: tuple[Column[Record], ...] = (
    Column("chain", lambda row: row["of"]["chain"], numeric=False),
    Column("gates (mm)", lambda row: row["of"]["heights_mm"], numeric=False),
    Column("void", _each(_share("void_share"))),
    Column("marginal", _each(_share("marginal_share"))),
    Column("wrong", _each(lambda cell: str(cell["wrong"]))),
    Column("of", lambda row: next(
        (_symbol(cell["measured"]) for cell in row["cells"] if cell["measured"]), ""
    ), numeric=False),
    Column("rms error", _each(_size)),
    Column("rms error/u", _each(_ratio)),
    Column("times lstsq", _each(_times)),
)  # fmt: skip
_TOTALS: tuple[Column[Record], ...] = (
    Column("disturbances", lambda one: one["disturbance"], numeric=False),
    Column("drops", lambda one: str(one["drops"])),
    Column("beyond limits", lambda one: str(one["beyond"])),
    Column("void", lambda one: f"{one['void_share']:.1%}"),
    Column("marginal", lambda one: f"{one['marginal_share']:.1%}"),
    Column("wrong drops", lambda one: str(one["wrong"])),
    Column("edges", lambda one: str(one["edges"])),
    Column("wrong edges", lambda one: str(one["wrong_edges"])),
    Column("rms error/u", _ratio),
    Column("ms a drop", lambda one: f"{one['ms_per_drop']:.1f}"),
    Column("times lstsq", _times),
)
