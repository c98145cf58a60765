"""``rig bench stability``."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING

from rig.bench.stability import StabilityRow, sonic_lengths, stability
from rig.commands.output import print_json
from rig.files import make_folder, write_atomic
from rig.text_table import csv_text

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Sequence

FAILED = 1


def main(arguments: Namespace) -> int:
    """Print one row a scene, and keep the table."""
    show = None if arguments.json else _print_row
    rows = stability(progress=show)
    counts = {verdict: sum(row.verdict == verdict for row in rows) for verdict in _VERDICTS}
    sonic = [asdict(one) for one in sonic_lengths()]
    found = {"rows": [asdict(row) for row in rows], "counts": counts, "sonic": sonic}
    if arguments.json:
        print_json(found)
    else:
        print(", ".join(f"{n} {verdict}" for verdict, n in counts.items()))
        for one in sonic:
            print(
                f"each rod {one['ratio']:g} of the one below: faster than sound from "
                f"{one['rods']} rods, {one['length_m']:.2f} m, {one['decades']:.1f} decades of mass"
            )
    if arguments.output is not None:
        _write(Path(arguments.output), rows, json.dumps(found, indent=2, ensure_ascii=False))
    return FAILED if counts["FAILED"] else 0


_VERDICTS = ("exact", "noted", "refused", "FAILED")


def _print_row(row: StabilityRow) -> None:
    errors = [
        "–" if error is None else f"{error:.1e}"
        for error in (row.separation_error, row.speed_error)
    ]
    said = f"  {row.note}" if row.note else ""
    print(
        f"{f'{row.group} {row.value}':<40} Δz {errors[0]:>8}  V {errors[1]:>8}  {row.verdict:<8}"
        f"as printed: {row.naive}{said}",
        flush=True,
    )


def _write(folder: Path, rows: Sequence[StabilityRow], text: str) -> None:
    """Write ``stability.csv`` and ``stability.json``."""
    make_folder(folder)
    columns = [field.name for field in fields(StabilityRow)]
    table = csv_text(columns, (asdict(row) for row in rows))
    write_atomic(folder / "stability.csv", table)
    write_atomic(folder / "stability.json", text + "\n")
