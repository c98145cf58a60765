"""A timer's file: its events, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps), oscilloscopes (volts), and the
project's own format, which leaves nothing open. What a file does not say (which gate, which level
is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rig.reasons import make_reason
from rig.timers.columns import columns_of
from rig.timers.events import FilePart, RowReader, split_at_jumps
from rig.timers.lines import read_lines
from rig.timers.moments import TICK_HZ
from rig.timers.problems import ProblemList
from rig.timers.signals import find_threshold, volts_of
from rig.timers.table import HEADER, RowBlock, Table, find_time_base
from rig.timers.vcd import is_vcd, vcd_columns, vcd_rows
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
    period_s
        Of samples: no edge is known better than that; `None` for stamps.
    is_regular
        Whether samples are all as far apart, so that a row may have several changes.
    has_unit
        Whether the file says the unit of its times; without it they are read as seconds.
    rows
        How many lines of data there are.
    silent
        Of them, how many only say that nothing changes: samples, and states as they were.
    is_sampled
        Whether it has samples: a level that changes may be of an input that is no gate.
    unread
        Lines of data that say nothing, the first of them.
    notes
        What is to be said, a reason each.
    """

    kind: str = "a value change dump"
    is_own: bool = False
    columns: dict[str, str] = field(default_factory=dict)
    parts: list[FilePart] = field(default_factory=list)
    period_s: float | None = None
    is_regular: bool = False
    has_unit: bool = True
    rows: int = 0
    silent: int = 0
    is_sampled: bool = False
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)

    def add(self, reader: RowReader) -> None:
        """Count the rows of a block."""
        self.rows += reader.rows
        self.silent += reader.silent
        self.unread += reader.unread
        self.is_sampled |= reader.is_sampled

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
        numbered = enumerate(lines, 1)
        columns = vcd_columns(numbered, problems)
        if len(columns) == 1:
            problems.refuse(1, 1, "no_edges")
        reader = RowReader(columns, [], problems)
        reader.read(vcd_rows(numbered, columns, problems))
        file.add(reader)
        file.parts += reader.parts.values()
        file.period_s = 10.0 ** -(columns[0].power or 0)
    else:
        table = Table(lines)
        file.is_own = table.is_own
        problems.hint = "" if table.is_own else _HINT  # its faults are told each
        file.kind = f"the project's own format: {','.join(HEADER)}"
        if not table.is_own:
            name = recognise_format(table.head[:40])
            file.kind = f"a table, its cells separated by {_SEPARATORS[table.separator]}"
            file.kind += f"; it looks like {name}" if name else ""
        above = RowBlock()
        for n, (block, rows) in enumerate(table.blocks()):
            _read_block(file, table, block, above, n, rows, path, unit, problems)
            above = block
        file.rows += table.stray_count
        file.unread += table.strays
    problems.raise_if_any()
    file.parts = [part for part in file.parts if part.events]
    if not file.parts:
        notes = "".join(f"; {note}" for note in file.notes)
        problems.refuse(1, 1, "nothing_passes" if file.rows else "no_edges", notes=notes)
    return file


def _read_block(
    file: TimerFile,
    table: Table,
    block: RowBlock,
    above: RowBlock,
    n: int,
    rows: Iterator[Row],
    path: str | os.PathLike[str],
    unit: str | None,
    problems: ProblemList,
) -> None:
    """Add what the n-th block of a table says."""
    sample = list(itertools.islice(rows, _SAMPLE))
    width, own = max(len(row.texts) for row in sample), block.headings
    if width > MAX_COLUMNS:
        problems.refuse(sample[0].line, 1, "too_many_columns", columns=width, limit=MAX_COLUMNS)
    if not any(len(row.texts) > 1 or width == 1 for row in own) or (
        above.headings and not any(len(row.texts) == width for row in own)
    ):
        block.headings = [*own, *above.headings]
    if table.is_own and tuple(text.lower() for text in own[0].texts) != HEADER:
        problems.refuse(own[0].line, 1, "wrong_header", header=",".join(HEADER))
    columns = columns_of(block, sample, table, unit, problems)
    problems.raise_if_any()
    roles, base = {column.role for column in columns}, (0.0, 1.0)
    if "time" not in roles and roles & {"level", "volts"}:
        stated = find_time_base([*table.remarks, *block.headings])
        base = stated or base
        if stated is None:
            problems.refuse(sample[0].line, 1, "no_rate", lacks="a column of times or a rate")
    elif "time" not in roles:
        durations = [repr(column.name) for column in columns if column.role == "duration"]
        heading = own[0].line if own else sample[0].line
        code = "durations" if durations else "no_time_column"
        problems.refuse(heading, 1, code, numbers=", ".join(durations))
    file.columns |= {column.name: column.meaning for column in columns}
    file.has_unit &= all(column.power is not None for column in columns)
    reader = RowReader(columns, sample, problems, base, is_own=table.is_own)
    _set_thresholds(file, reader, path, n)
    reader.read(itertools.chain(sample, rows))
    problems.raise_if_any()
    file.add(reader)
    if reader.is_sampled:
        parts = list(reader.parts.values())
        file.period_s = reader.period_s()
        file.is_regular = file.period_s is not None
        for signal in reader.signals:
            if signal.threshold:
                values = {"input": signal.label, "level": signal.threshold.centre}
                count = sum(e.label == signal.label for part in parts for e in part.events)
                file.notes.append(make_reason("crossings", crossings=count, **values))
        file.parts += parts
    else:
        _add_parts(file, reader, block, sample[0].line, columns, problems)


def _set_thresholds(
    file: TimerFile, reader: RowReader, path: str | os.PathLike[str], n: int
) -> None:
    """Find the levels of volts, for which all rows of the n-th block are read beforehand."""
    signals = [(s, s.value.at) for s in reader.signals if s.value and s.value.role == "volts"]
    if not signals:
        return
    _, rows = next(itertools.islice(Table(read_lines(path)).blocks(), n, None))
    values = [array("f") for _ in signals]
    for row in rows:
        for (_, at), volts in zip(signals, values, strict=True):
            value = volts_of(row.cell(at))
            if value is not None:
                volts.append(value)
    for (signal, _), volts in zip(signals, values, strict=True):
        signal.threshold = find_threshold(np.asarray(volts))
        if signal.threshold is None:
            low, high = min(volts), max(volts)
            file.notes.append(make_reason("no_passage", input=signal.label, low=low, high=high))


def _add_parts(
    file: TimerFile,
    reader: RowReader,
    block: RowBlock,
    line: int,
    columns: Sequence[TimerColumn],
    problems: ProblemList,
) -> None:
    """Add passages, divided where times begin anew; refuse what is no moment of a passage."""
    roles = {column.role for column in columns}
    is_stated = bool({"edge", "state", "gate", "run"} & roles)
    unused = ", ".join(c.name for c in columns if c.role in {"other", "duration"})
    for part in reader.parts.values():
        lines = [event.line for event in part.events]
        if len(set(lines)) == 1:  # columns of a row may stand in any order
            part.events.sort(key=lambda event: event.tick)
        steps = [b.tick - a.tick for a, b in itertools.pairwise(part.events)]
        backwards = sum(step < 0 for step in steps)
        if not is_stated and backwards > 1 and backwards * 4 > len(lines):
            problems.refuse(line, 1, "durations", numbers="these numbers go up and down: they")
        if "other" in roles and not is_stated and len(steps) > 3 and max(steps) < 1.5 * min(steps):
            problems.refuse(line, 1, "regular_samples", columns=unused)
        in_order = len(set(lines)) == len(lines)
        pieces = [part] if reader.has_runs else split_at_jumps(part, in_order=in_order)
        short = [k for k, piece in enumerate(pieces) if len(piece.events) < 2]
        if len(pieces) > 1 and short:
            event = pieces[max(1, short[-1])].events[0]
            problems.add(event.line, 1, "time", "backwards", text=f"{event.tick / TICK_HZ:.9g}")
        mark = " ".join(block.headings[0].texts) if block.headings else ""
        for piece in pieces:
            piece.name = piece.name or part.name or mark
        file.parts += pieces
    if unused:
        file.notes.append(make_reason("columns_unused", columns=unused))
