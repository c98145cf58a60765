"""``rig bench stability``."""

import math
from argparse import Namespace
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from rig.bench.figures import conditioning_figure
from rig.bench.findings import Findings
from rig.bench.stability import VERDICTS, StabilityRow, stability
from rig.bench.work import EPSILON
from rig.plain_data import plain
from rig.text_table import text_table

_HEAD = Path(__file__).with_suffix(".md").read_text("utf-8").rstrip()
_NAMES = {"alpha": "α", "gamma": "γ", "separation": "Δz", "speed": "V", "time": "t", "gravity": "g"}


def run(arguments: Namespace) -> Iterator[Findings]:
    """Examine every case; an error that the condition does not explain is a failure."""
    rows = stability(quick=arguments.quick)
    counts = {verdict: sum(row.verdict == verdict for row in rows) for verdict in VERDICTS}
    records = plain([row._asdict() for row in rows])
    lines = [
        *_summary(rows), "", ", ".join(f"{n} {verdict}" for verdict, n in counts.items()), "",
        *_table(rows),
    ]  # fmt: skip
    yield Findings(
        {"rows": records, "counts": counts}, lines, _HEAD, records, conditioning_figure(rows),
        failed=counts["FAILED"] > 0,
    )  # fmt: skip


def _lost(error: float | None) -> float:
    """Return how many decimal digits of a float's sixteen an error has cost."""
    return min(16.0, max(0.0, math.log10(error / EPSILON))) if error else 0.0


def _summary(rows: Iterable[StabilityRow]) -> list[str]:
    """Return for each quantity where we lost most beside what was expected, and as printed."""
    table = [["", "rows", "digits lost", "expected", "in", "as printed", "in"]]
    for name, words in _NAMES.items():
        some = [row for row in rows if row.quantity == name]
        worst = max(some, key=lambda row: (row.error or 0.0) / (row.expected or 1.0))
        plain = max(some, key=lambda row: row.naive_error or 0.0)
        table.append([
            words, str(len(some)), f"{_lost(worst.error):.1f}", f"{_lost(worst.expected):.1f}",
            worst.case, f"{_lost(plain.naive_error):.1f}", plain.case,
        ])  # fmt: skip
    return text_table(table, left={0, 4, 6}, rule=True)


def _table(rows: Iterable[StabilityRow]) -> list[str]:
    """Return the ends by themselves at which printed equations lose most, and what is no number."""
    table = [["", "", "error", "κ·ε", "backward", "printed", ""]]
    for case, group in groupby(rows, lambda row: row.case):
        row = max(group, key=lambda row: row.naive_error or 0.0)
        alone = " + " not in case and _lost(row.naive_error or 1.0) > _lost(row.expected) + 4
        if alone or row.verdict == "FAILED":
            numbers = (f"{x or 0.0:.0e}" for x in (row.error, row.expected, row.backward))
            table.append([case, _NAMES.get(row.quantity, ""), *numbers, row.naive, row.verdict])
    return text_table(table, left={0, 1, 6}, rule=True)
