"""A timer's file: its events, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps), oscilloscopes (volts), and the
project's own format, which leaves nothing open. What a file does not say (which gate, which level
is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rig.reasons import make_reason
from rig.timers.columns import columns_of
from rig.timers.events import TICK_HZ, FilePart, RowReader, split_at_jumps
from rig.timers.lines import read_lines
from rig.timers.problems import ProblemList
from rig.timers.samples import read_samples
from rig.timers.table import HEADER, RowBlock, Table, find_time_base
from rig.timers.vcd import is_vcd, read_vcd
from rig.timers.vocabulary import number_of, recognise_format

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from rig.reasons import Reason
    from rig.timers.columns import TimerColumn
    from rig.timers.table import Row

MAX_COLUMNS = 200
_SAMPLE = 200
"""Rows that show what columns are."""
_HINT = (
    "accepted are run,channel,time_s,state; tables with a heading such as time (s), gate, state; "
    "samples of inputs (0 and 1, or volts) with times; and value change dumps; see "
    "rig import --list-formats"
)
_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks", "|": "bars"}


@dataclass(slots=True)
class TimerFile:
    """What was understood of a file.

    Attributes
    ----------
    kind
        In words.
    is_own
        Whether it has the project's own format.
    columns
        What each column was taken for, by its heading.
    parts
        Events of each run, or of each gate where these stand one below the other.
    begins
        The level that each input begins with, where samples say.
    period_s
        Of samples: no edge is known better than that; `None` for stamps.
    has_unit
        Whether the file says the unit of its times; without it they are read as seconds.
    rows
        How many lines of data there are.
    silent
        Of them, how many only say that nothing changes: samples, and states as they were.
    sampled
        Lines of samples that have a change, of an input that may be no gate.
    unread
        Lines of data that say nothing, the first of them.
    notes
        What is to be said, a reason each.
    """

    kind: str = "a value change dump"
    is_own: bool = False
    columns: dict[str, str] = field(default_factory=dict)
    parts: list[FilePart] = field(default_factory=list)
    begins: dict[str, str] = field(default_factory=dict)
    period_s: float | None = None
    has_unit: bool = True
    rows: int = 0
    silent: int = 0
    sampled: set[int] = field(default_factory=set)
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {event.label for part in self.parts for event in part.events} - {""}
        return tuple(sorted(labels, key=lambda label: (number_of(label) or 0, label)))


def read_timer_file(path: str | os.PathLike[str], unit: str | None = None) -> TimerFile:
    """Find out what a file says.

    Parameters
    ----------
    path
        The file.
    unit
        Of its times where it does not say: ``s``, ``ms``, ``us`` or ``ns``.

    Raises
    ------
    InputError
        Every fault of the file at its line and column.
    """
    problems = ProblemList(str(path), _HINT)
    file, lines = TimerFile(), read_lines(path)
    head = list(itertools.islice(lines, 50))
    lines = itertools.chain(head, lines)
    if is_vcd(head):
        events, file.begins, scale = read_vcd(lines, problems)
        file.period_s, file.parts = scale / TICK_HZ, [FilePart(events=events)]
        file.rows = len({event.line for event in events})
    else:
        _read_table(file, Table(lines), unit, problems)
    problems.raise_if_any()
    file.parts = [part for part in file.parts if part.events]
    if not file.parts:
        notes = "".join(f"; {note}" for note in file.notes)
        problems.refuse(1, 1, "nothing_passes" if file.rows else "no_edges", notes=notes)
    return file


def _read_table(file: TimerFile, table: Table, unit: str | None, problems: ProblemList) -> None:
    name = recognise_format(table.head[:40])
    file.kind = f"a table, its cells separated by {_SEPARATORS[table.separator]}"
    file.kind += f"; it looks like {name}" if name else ""
    file.is_own = table.is_own
    if file.is_own:  # its faults are told each
        problems.hint = ""
        file.kind = f"the project's own format: {','.join(HEADER)}"
    above = RowBlock()
    for block, rows in table.blocks():
        sample = list(itertools.islice(rows, _SAMPLE))
        width = max(len(row.texts) for row in sample)
        if width > MAX_COLUMNS:
            values = {"columns": width, "limit": MAX_COLUMNS}
            problems.refuse(sample[0].line, 1, "too_many_columns", **values)
        own = block.headings
        if not any(len(row.texts) > 1 or width == 1 for row in own) or (
            above.headings and not any(len(row.texts) == width for row in own)
        ):
            block.headings = [*own, *above.headings]
        above = block
        if table.is_own and tuple(text.lower() for text in own[0].texts) != HEADER:
            problems.refuse(own[0].line, 1, "wrong_header", header=",".join(HEADER))
        columns = columns_of(block, sample, table, unit, problems)
        problems.raise_if_any()
        file.columns |= {column.name: column.meaning for column in columns}
        file.has_unit &= all(column.power is not None for column in columns)
        roles = {column.role for column in columns}
        if roles & {"level", "volts"}:
            is_timed = "time" in roles
            base = None if is_timed else find_time_base([*table.remarks, *block.headings])
            if base is None and not is_timed:
                problems.refuse(sample[0].line, 1, "no_rate", lacks="a column of times or a rate")
            read_samples(file, itertools.chain(sample, rows), columns, base, problems)
        elif "time" in roles:
            _add_rows(file, block, sample, rows, columns, table, problems)
        else:
            durations = [repr(column.name) for column in columns if column.role == "duration"]
            heading = block.headings[0].line if block.headings else sample[0].line
            code = "durations" if durations else "no_time_column"
            problems.refuse(heading, 1, code, numbers=", ".join(durations))
    file.rows += table.stray_count
    file.unread += table.strays


def _add_rows(
    file: TimerFile,
    block: RowBlock,
    sample: Sequence[Row],
    rows: Iterator[Row],
    columns: Sequence[TimerColumn],
    table: Table,
    problems: ProblemList,
) -> None:
    reader = RowReader(columns, sample, problems, is_own=table.is_own)
    reader.read(itertools.chain(sample, rows))
    problems.raise_if_any()
    file.rows += reader.rows
    file.silent += reader.silent
    file.unread += reader.unread
    roles = {column.role for column in columns}
    stated = {"edge", "state", "gate", "run"} & roles
    unused = [column.name for column in columns if column.role in {"other", "duration"}]
    for part in reader.parts.values():
        lines = [event.line for event in part.events]
        if len(set(lines)) == 1:  # columns of a row may stand in any order
            part.events.sort(key=lambda event: event.tick)
        ticks = [event.tick for event in part.events]
        steps = [b - a for a, b in itertools.pairwise(ticks)]
        backwards = sum(step < 0 for step in steps)
        if not stated and backwards > 1 and backwards * 4 > len(ticks):
            numbers = "these numbers go up and down: they"
            problems.refuse(sample[0].line, 1, "durations", numbers=numbers)
        if "other" in roles and not stated and len(steps) > 3 and max(steps) < 1.5 * min(steps):
            problems.refuse(sample[0].line, 1, "regular_samples", columns=", ".join(unused))
        in_order = len(set(lines)) == len(lines)
        parts = [part] if reader.has_runs else split_at_jumps(part, in_order=in_order)
        short = [k for k, piece in enumerate(parts) if len(piece.events) < 2]
        if len(parts) > 1 and short:
            event = parts[max(1, short[-1])].events[0]
            problems.add(event.line, 1, "time", "backwards", text=f"{event.tick / TICK_HZ:.9g}")
        mark = " ".join(block.headings[0].texts) if block.headings and not part.name else ""
        for piece in parts:
            piece.name = piece.name or mark
        file.parts += parts
    if unused:
        file.notes.append(make_reason("columns_unused", columns=", ".join(unused)))
