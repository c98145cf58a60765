"""A timer's file: its events, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps) and oscilloscopes (volts). What a
file does not say (which gate, which level is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import closing
from typing import TYPE_CHECKING

from rig.reasons import make_reason
from rig.timers.columns import columns_of
from rig.timers.lines import is_cut, read_lines
from rig.timers.signals import SignalReader
from rig.timers.table import Row, RowBlock, Table
from rig.timers.vcd import BEGINNINGS, vcd_rows

if TYPE_CHECKING:
    from rig.timers.events import TimerFile

_SAMPLE = 200
"""Rows that show what columns are."""
_MARKS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "blanks", "": "words"}


def read_file(file: TimerFile) -> TimerFile:
    """Find out what a file says, in the way in which its columns are to be understood.

    Raises
    ------
    InputError
        Every fault of the file at its line and column, or what it is instead.
    """
    with closing(read_lines(file.path)) as lines:
        head = list(itertools.islice(lines, 50))
        numbered = enumerate(itertools.chain(head, lines), 1)
        is_dump = "".join(head).lstrip().startswith(BEGINNINGS)
        table = Table(vcd_rows(numbered, file.problems) if is_dump else numbered)
        file.lines.append(f"a table, its cells separated by {_MARKS[table.separator]}")
        readers: dict[object, SignalReader] = {}
        for block, rows in table.blocks():
            _read_block(file, block, rows, readers)
            file.problems.raise_if_any()
    file.rows += len(table.strays)
    file.unread += table.strays
    if not file.events:
        notes = "".join(f"; {note}" for note in file.notes)
        file.problems.refuse(1, 1, "nothing_passes" if file.rows else "no_edges", notes=notes)
    file.notes += [make_reason("last_line_cut")] if is_cut(file.path) else []
    return file


def _read_block(
    file: TimerFile, block: RowBlock, rows: Iterator[Row], readers: dict[object, SignalReader]
) -> None:
    """Add what a block says; its columns are those of earlier ones with the same heading."""
    start, key = len(file.events), block.key
    if key not in readers:
        sample = list(itertools.islice(rows, _SAMPLE))
        columns = columns_of(file, block, sample)
        file.lines += [f"  {column.name}: {column.meaning}" for column in columns]
        readers[key], rows = SignalReader(file, columns, sample), itertools.chain(sample, rows)
        unused = readers[key].unused
        file.notes += [make_reason("columns_unused", columns=unused)] if unused else []
    reader = readers[key]
    base = (0.0, 1.0) if "time" in reader.places else block.find_time_base()
    if reader.is_sampled and base is None:
        lacks = "a column of times or a rate"
        file.problems.refuse(next(rows).line, 1, "no_rate", lacks=lacks)
    reader.read(rows, base or (0.0, 1.0), is_gate=block.is_gate)
    is_told = {"edge", "state", "cleared", "gate"} & reader.places.keys()
    if reader.unused and reader.is_stacked and not is_told:
        steps = [b.tick - a.tick for a, b in itertools.pairwise(file.events[start:])]
        if len(steps) > 3 and max(steps) < 1.5 * min(steps):
            line = file.events[start].line
            file.problems.refuse(line, 1, "regular_samples", columns=reader.unused)
