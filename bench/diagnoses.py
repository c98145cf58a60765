"""``./run bench diagnoses``."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from bench.studies.diagnoses import CLEAN, DROPS, LAYOUTS, OUTCOMES, study
from bench.studies.layout_catalogue import chosen
from rig.commands.output import leave_study, say
from rig.files import make_folder
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping, Sequence

    Record = Mapping[str, Any]

_HEADINGS = (
    "named rightly", "among the likeliest", "void or remarked, unnamed", "named wrongly",
    "not noticed",
)  # fmt: skip


_HEAD = """\
# Which faults of a rig are named

`./run bench diagnoses --drops {drops} --clean {clean}`: on each layout, {drops} drops of a rig
with one fault, and {clean} without a fault. A fault within the protocol's own ± is rightly not
noticed. By layout: `diagnoses.csv`."""


def main(arguments: Namespace) -> int:
    """Drop chains on rigs with one fault each; keep the table, and print it."""
    layouts = chosen(LAYOUTS, arguments.only)
    folder = make_folder(arguments.output)
    clean = CLEAN if arguments.clean is None else arguments.clean
    drops = arguments.drops or DROPS
    found = study(layouts, drops, clean, arguments.jobs, say)
    records = [cell.json() for cell in found]
    table = csv_text([name for name in records[0] if name != "said"], records)
    leave_study(
        folder, "diagnoses", _HEAD.format(drops=drops, clean=clean), _lines(records),
        {"diagnoses": records}, table, as_json=arguments.json,
    )  # fmt: skip
    return 0


def _lines(records: Sequence[Record]) -> list[str]:
    """One row a fault and size, all layouts together."""
    rows: dict[tuple[str, str], Counter[str]] = {}
    for one in records:
        counts = rows.setdefault((one["fault"], one["size"]), Counter())
        counts.update({name: one[name] for name in OUTCOMES})
    table = [
        [*words, *(str(counts[name] or "–") for name in OUTCOMES)] for words, counts in rows.items()
    ]
    return text_table([["fault", "size", *_HEADINGS], *table], left={0, 1}, rule=True)
