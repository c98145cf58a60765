"""``rig bench stability``."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict, fields
from typing import Any

from rig.bench.stability import StabilityRow, sonic_lengths, stability
from rig.commands.output import print_found, write_study
from rig.files import make_folder
from rig.text_table import csv_text

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
    sonic = [asdict(row) for row in sonic_lengths()]
    study: dict[str, Any] = {
        "rows": [asdict(row) for row in rows],
        "counts": counts,
        "sonic": sonic,
    }
    totals = [
        ", ".join(f"{n} {verdict}" for verdict, n in counts.items()),
        *(
            f"each rod {row['ratio']:g} of the one below: faster than sound from "
            f"{row['rods']} rods, {row['length_m']:.2f} m, {row['decades']:.1f} decades of mass"
            for row in sonic
        ),
    ]
    print_found(study, lambda: "\n".join(totals), as_json=arguments.json)
    if arguments.output is not None:
        numbers = csv_text([field.name for field in fields(StabilityRow)], study["rows"])
        lines = [*map(_line, rows), "", *totals]
        write_study(make_folder(arguments.output), "stability", _HEAD, lines, study, numbers)
    return FAILED if counts["FAILED"] else 0


_VERDICTS = ("exact", "noted", "refused", "FAILED")


def _line(row: StabilityRow) -> str:
    errors = [
        "–" if error is None else f"{error:.1e}"
        for error in (row.separation_error, row.speed_error)
    ]
    lines = f"  {row.note}" if row.note else ""
    return (
        f"{f'{row.group} {row.value}':<40} {errors[0]:>8} {errors[1]:>8}  {row.verdict:<8} "
        f"{row.naive}{lines}"
    )
