"""``rig bench stability``."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from typing import TYPE_CHECKING

from rig.bench.stability import StabilityRow, sonic_lengths, stability
from rig.commands.output import print_json, write_page
from rig.files import make_folder, write_atomic
from rig.text_table import csv_text

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Sequence
    from pathlib import Path

FAILED = 1
_HEAD = """\
# The model in extreme cases

`rig bench stability`: relative errors of Δz and V against 50 digits, a verdict, and the same two
errors of the equations computed as printed. *Noted*: outside the model's domain, with a note.
*Refused*: ends with an error."""


def main(arguments: Namespace) -> int:
    """Print one row a scene, and keep the table."""
    rows = stability(progress=None if arguments.json else lambda row: print(_line(row), flush=True))
    counts = {verdict: sum(row.verdict == verdict for row in rows) for verdict in _VERDICTS}
    sonic = [asdict(one) for one in sonic_lengths()]
    found = {"rows": [asdict(row) for row in rows], "counts": counts, "sonic": sonic}
    totals = [
        ", ".join(f"{n} {verdict}" for verdict, n in counts.items()),
        *(
            f"each rod {one['ratio']:g} of the one below: faster than sound from "
            f"{one['rods']} rods, {one['length_m']:.2f} m, {one['decades']:.1f} decades of mass"
            for one in sonic
        ),
    ]
    if arguments.json:
        print_json(found)
    else:
        print("\n".join(totals))
    if arguments.output is not None:
        folder = make_folder(arguments.output)
        _write(folder, rows, json.dumps(found, indent=2, ensure_ascii=False))
        write_page(folder, "stability", _HEAD, [*map(_line, rows), "", *totals])
    return FAILED if counts["FAILED"] else 0


_VERDICTS = ("exact", "noted", "refused", "FAILED")


def _line(row: StabilityRow) -> str:
    errors = [
        "–" if error is None else f"{error:.1e}"
        for error in (row.separation_error, row.speed_error)
    ]
    said = f"  {row.note}" if row.note else ""
    return (
        f"{f'{row.group} {row.value}':<40} {errors[0]:>8} {errors[1]:>8}  {row.verdict:<8} "
        f"{row.naive}{said}"
    )


def _write(folder: Path, rows: Sequence[StabilityRow], text: str) -> None:
    """Write ``stability.csv`` and ``stability.json``."""
    columns = [field.name for field in fields(StabilityRow)]
    table = csv_text(columns, (asdict(row) for row in rows))
    write_atomic(folder / "stability.csv", table)
    write_atomic(folder / "stability.json", text + "\n")
