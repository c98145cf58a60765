"""``rig bench stability``."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

from rig.bench.stability import StabilityRow, sonic_lengths, stability
from rig.commands.output import print_found, write_study
from rig.files import make_folder
from rig.text_table import csv_text

if TYPE_CHECKING:
    from argparse import Namespace

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
    found: dict[str, Any] = {
        "rows": [asdict(row) for row in rows],
        "counts": counts,
        "sonic": sonic,
    }
    totals = [
        ", ".join(f"{n} {verdict}" for verdict, n in counts.items()),
        *(
            f"each rod {one['ratio']:g} of the one below: faster than sound from "
            f"{one['rods']} rods, {one['length_m']:.2f} m, {one['decades']:.1f} decades of mass"
            for one in sonic
        ),
    ]
    print_found(found, lambda: "\n".join(totals), as_json=arguments.json)
    if arguments.output is not None:
        numbers = csv_text([field.name for field in fields(StabilityRow)], found["rows"])
        said = [*map(_line, rows), "", *totals]
        write_study(make_folder(arguments.output), "stability", _HEAD, said, found, numbers)
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
