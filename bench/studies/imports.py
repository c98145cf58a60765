"""Files of other timers, all of one known truth, and mutants of each: none is read as another."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.frame import Findings
from bench.workers import results
from rig.text_table import text_table
from tests.timers import test_import_shapes

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_SHAPES: Any = test_import_shapes  # tests have no types
_HEAD = """\
# Is a timer's file read as another truth?

`./run bench imports`: files as programs of many makers write them, all of three known drops, and
mutants of each: rows deleted, columns exchanged, headings translated, cells emptied. Refused is
what a mutant no longer says, or says in two ways. Wrong is an edge that is none, and no error."""
_KINDS = ("read", "refused", "wrong")


def run(arguments: Namespace) -> Iterator[Findings]:
    """Read every mutant of every shape; it has failed when one is read as another truth."""
    seeds = range(arguments.seed, arguments.seed + arguments.mutants)
    calls = [(_count, name, seeds) for name in _SHAPES.SHAPES]
    rows = list(results(calls, arguments.jobs))
    rows.append({"shape": "all", **{kind: sum(row[kind] for row in rows) for kind in _KINDS}})
    table = [["shape", *_KINDS], *([str(cell) for cell in row.values()] for row in rows)]
    lines = text_table(table, left={0}, rule=True)
    yield Findings({"shapes": rows}, lines, _HEAD, rows, failed=rows[-1]["wrong"] > 0)


def _count(name: str, seeds: range) -> dict[str, Any]:
    with TemporaryDirectory(prefix="rig-imports-") as folder:
        outcomes = _SHAPES.read_mutants(Path(folder) / "file", name, seeds)
    return {"shape": name, **{kind: len(outcomes[kind]) for kind in _KINDS}}
