"""A timer's file: its events, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps), oscilloscopes (volts), and the
project's own format, which leaves nothing open. What a file does not say (which gate, which level
is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from rig.errors import InputError
from rig.reasons import Reason, make_reason
from rig.timers.columns import VALUES, columns_of
from rig.timers.edge_rows import HEADER
from rig.timers.events import FilePart, RowReader
from rig.timers.lines import find_kind, is_cut, read_lines
from rig.timers.moments import TICK_HZ, moment
from rig.timers.problems import ProblemList
from rig.timers.samples import read_samples
from rig.timers.table import Row, RowBlock, Table
from rig.timers.vcd import BEGINNINGS, vcd_rows
from rig.timers.vocabulary import LONGEST, number_of, recognise_format

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
        Of samples that are all as far apart, so that a row may have several changes: no edge is
        known better than that; `None` for others.
    has_unit
        Whether the file says the unit of its times; without it they are read as seconds.
    rows
        How many lines of data there are.
    is_sampled
        Whether it has samples: a level that changes may be of an input that is no gate.
    unread
        Those that neither change anything nor say that nothing changes.
    notes
        What is to be said, a reason each.
    """

    kind: str
    is_own: bool = False
    columns: dict[str, str] = field(default_factory=dict)
    parts: list[FilePart] = field(default_factory=list)
    period_s: float | None = None
    has_unit: bool = True
    rows: int = 0
    is_sampled: bool = False
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {event.label for part in self.parts for event in part.events} - {""}
        return tuple(sorted(labels, key=lambda label: (number_of(label) or 0, label)))


def read_timer_file(path: str | Path, unit: str | None = None) -> TimerFile:
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
        Every fault of the file at its line and column, or what it is instead.
    """
    try:
        file = _read(read_lines(path), unit, ProblemList(str(path), _HINT))
    except InputError as error:
        if error.problems and (kind := find_kind(path)):
            ProblemList(str(path)).refuse(1, 1, "other_kind", kind=kind)
        raise
    file.notes += [make_reason("last_line_cut")] if is_cut(path) else []
    return file


def _read(lines: Iterator[str], unit: str | None, problems: ProblemList) -> TimerFile:
    head = list(itertools.islice(lines, 50))
    numbered = enumerate(itertools.chain(head, lines), 1)
    is_dump = "".join(head).lstrip().startswith(BEGINNINGS)
    table = Table(vcd_rows(numbered, problems) if is_dump else numbered, problems)
    file = TimerFile(f"the project's own format: {','.join(HEADER)}", table.is_own)
    if table.is_own:
        problems.hint = ""  # its faults are told each
    else:
        name = recognise_format("\n".join(line[:LONGEST] for line in head))
        file.kind = f"a table, its cells separated by {_SEPARATORS[table.separator]}"
        file.kind += f"; it looks like {name}" if name else ""
    for block, rows in table.blocks():
        _read_block(file, table, block, rows, unit)
    file.rows += len(table.strays)
    file.unread += table.strays
    problems.raise_if_any()
    if not file.parts:
        notes = "".join(f"; {note}" for note in file.notes)
        problems.refuse(1, 1, "nothing_passes" if file.rows else "no_edges", notes=notes)
    return file


def _read_block(
    file: TimerFile, table: Table, block: RowBlock, rows: Iterator[Row], unit: str | None
) -> None:
    """Add what a block says: samples, or passages, divided where times begin anew."""
    sample, problems = list(itertools.islice(rows, _SAMPLE)), table.problems
    columns = columns_of(block, sample, table, unit)
    problems.raise_if_any()
    file.columns |= {column.name: column.meaning for column in columns}
    file.has_unit &= all(column.power is not None for column in columns)
    unused = ", ".join(column.name for column in columns if column.role in {"other", "duration"})
    reader = RowReader(columns, sample, problems, table.is_own)
    is_sampled = any(column.role in VALUES[0] for column in columns)
    if is_sampled:
        file.notes += read_samples(reader, sample, rows, table, block)
    else:
        reader.read(itertools.chain(sample, rows))
    problems.raise_if_any()
    file.notes += [make_reason("columns_unused", columns=unused)] if unused else []
    parts = list(reader.parts.values())
    if is_sampled:
        clock = reader.signals[0].clock
        ticks = (
            [moment(row.cell(clock.at), clock.power or 0) or 0 for row in sample] if clock else []
        )
        steps = [b - a for a, b in itertools.pairwise(ticks)] or [TICK_HZ]
        if max(steps) < 1.5 * statistics.median(steps):
            file.period_s = statistics.median(steps) / TICK_HZ * block.base[1]
    else:
        is_stated = bool({"edge", "state", "gate", "run"} & {column.role for column in columns})
        title = " ".join(block.headings[0].texts if block.headings else ())
        for part in parts:
            part.name = part.name or title
            if not is_stated:
                _check_moments(part, unused, problems)
        if not reader.has_runs:
            parts = [piece for part in parts for piece in _split_at_jumps(part, problems)]
    file.parts += parts
    file.rows += reader.rows
    file.unread += reader.unread
    file.is_sampled |= is_sampled


def _check_moments(part: FilePart, unused: str, problems: ProblemList) -> None:
    """Refuse numbers that are no moments of a passage: durations, or samples of something else."""
    if len({event.line for event in part.events}) == 1:  # columns may stand in any order
        part.events.sort(key=lambda event: event.tick)
    steps = [b.tick - a.tick for a, b in itertools.pairwise(part.events)]
    backwards = sum(step < 0 for step in steps)
    if backwards > 1 and backwards * 4 > len(part.events):
        numbers = "these numbers go up and down: they"
        problems.refuse(part.events[0].line, 1, "durations", numbers=numbers)
    if unused and len(steps) > 3 and max(steps) < 1.5 * min(steps):
        problems.refuse(part.events[0].line, 1, "regular_samples", columns=unused)


def _split_at_jumps(part: FilePart, problems: ProblemList) -> list[FilePart]:
    """Divide what stands one below the other where the times of an input do not go on."""
    pieces, last = [FilePart(part.name, part.number)], dict[str, int]()
    # Where each row has a single time, one before any above it begins anew.
    in_order = len({event.line for event in part.events}) == len(part.events)
    for event in part.events:
        latest = max(last.values(), default=0) if in_order else last.get(event.label, 0)
        if event.label in last and event.tick < latest:
            pieces.append(FilePart(part.name))
            last = {}
        last[event.label] = event.tick
        pieces[-1].events.append(event)
    for before, piece in itertools.pairwise(pieces):
        if min(len(before.events), len(piece.events)) == 1:
            line, text = piece.events[0].line, f"{piece.events[0].tick / TICK_HZ:.9g}"
            problems.add(line, 1, "time", "backwards", text=text)
    return pieces
