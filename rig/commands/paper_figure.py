"""``rig predict --figure``."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from rig.commands.output import say
from rig.errors import InputError
from rig.files import write_atomic
from rig.report.paper import paper_figure


def write_figure(number: int, output: str | None) -> None:
    """Write a figure of the paper as SVG and its numbers as CSV beside it."""
    if output is None or Path(output).suffix not in {".svg", ".csv"}:
        raise InputError(
            "a figure needs a file to go to", f"rig predict --figure {number} -o FILE.svg"
        )
    svg, columns = paper_figure(number)
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    path = Path(output)
    write_atomic(path.with_suffix(".svg"), svg)
    write_atomic(path.with_suffix(".csv"), table.getvalue())
    say(f"{path.with_suffix('.svg')} and {path.with_suffix('.csv')}")
