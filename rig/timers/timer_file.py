"""A timer's file: its events, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps) and oscilloscopes (volts). What a
file does not say (which gate, which level is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from rig.errors import InputError
from rig.reasons import Reason, make_reason
from rig.timers.columns import VALUES, columns_of, find_signals
from rig.timers.events import EventList, TimerEvent, read_passages
from rig.timers.lines import find_kind, is_cut, read_lines
from rig.timers.moments import TICK_HZ
from rig.timers.problems import ProblemList
from rig.timers.samples import SampleReader
from rig.timers.table import Row, RowBlock, Table, find_time_base
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


class FilePart(NamedTuple):
    """Events that stand together: those of a run, or of a gate.

    Attributes
    ----------
    name
        What the file calls it; empty where nothing is said.
    run
        The run, where the file says it.
    """

    name: str
    run: str
    events: list[TimerEvent]


@dataclass(slots=True)
class TimerFile:
    """What was understood of a file.

    Attributes
    ----------
    kind
        In words.
    columns
        What each column was taken for, by its heading.
    parts
        Events of each run, or of each gate where these stand one below the other.
    period_s
        Of samples that are all as far apart, so that a row may have several changes: no edge is
        known better than that; `None` for others.
    has_unit
        Whether the file says the unit of its times; without it they are read as seconds.
    is_sampled
        Whether it has samples: a level that changes may be of an input that is no gate.
    is_wide
        Whether a row has several times, so that it may be a run.
    unit
        Of its times where it does not say: ``s``, ``ms``, ``us`` or ``ns``.
    way, ways
        In which way, from 0, its columns are understood, and how many there are.
    rows
        How many lines of data there are.
    unread
        Those that neither change anything nor say that nothing changes.
    notes
        What is to be said, a reason each.
    """

    kind: str = ""
    columns: dict[str, str] = field(default_factory=dict)
    parts: list[FilePart] = field(default_factory=list)
    period_s: float | None = None
    has_unit: bool = True
    is_sampled: bool = False
    is_wide: bool = False
    unit: str | None = None
    way: int = 0
    ways: int = 1
    rows: int = 0
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {event.label for part in self.parts for event in part.events} - {""}
        return tuple(sorted(labels, key=lambda label: (number_of(label) or 0, label)))


def read_ways(path: str | Path, unit: str | None = None) -> list[TimerFile]:
    """Find out what a file says, in every way in which its columns may be understood.

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
    files, faults, file = list[TimerFile](), list[InputError](), TimerFile(unit=unit)
    while file.way < file.ways:
        try:
            _read(file, read_lines(path), ProblemList(str(path), _HINT))
            files.append(file)
        except InputError as error:
            faults.append(error)
        file = TimerFile(unit=unit, way=file.way + 1, ways=file.ways)
    if not files:
        if faults[0].problems and (kind := find_kind(path)):
            ProblemList(str(path)).refuse(1, 1, "other_kind", kind=kind)
        raise faults[0]
    for file in files if is_cut(path) else ():
        file.notes.append(make_reason("last_line_cut"))
    return files


def _read(file: TimerFile, lines: Iterator[str], problems: ProblemList) -> None:
    head = list(itertools.islice(lines, 50))
    numbered = enumerate(itertools.chain(head, lines), 1)
    is_dump = "".join(head).lstrip().startswith(BEGINNINGS)
    table = Table(vcd_rows(numbered, problems) if is_dump else numbered)
    cells = f"separated by {_SEPARATORS[table.separator]}" if table.separator else "between words"
    name = recognise_format("\n".join(line[:LONGEST] for line in head))
    file.kind = f"a table, its cells {cells}" + (f"; it looks like {name}" if name else "")
    for block, rows in table.blocks():
        _read_block(file, block, rows, problems)
        problems.raise_if_any()
    file.rows += len(table.strays)
    file.unread += table.strays
    if not file.parts:
        notes = "".join(f"; {note}" for note in file.notes)
        problems.refuse(1, 1, "nothing_passes" if file.rows else "no_edges", notes=notes)


def _read_block(
    file: TimerFile, block: RowBlock, rows: Iterator[Row], problems: ProblemList
) -> None:
    """Add what a block says: samples, or passages."""
    sample = list(itertools.islice(rows, _SAMPLE))
    rows = itertools.chain(sample, rows)
    columns = columns_of(file, block, sample, problems)
    file.columns |= {column.name: column.meaning for column in columns}
    file.has_unit &= all(column.power is not None for column in columns)
    roles, signals, out = {c.role for c in columns}, find_signals(columns), EventList(problems)
    unused = ", ".join(column.name for column in columns if column.role in {"other", "duration"})
    if roles & set(VALUES[0]):
        base = find_time_base(block)
        if base is None and "time" not in roles:
            problems.refuse(sample[0].line, 1, "no_rate", lacks="a column of times or a rate")
        reader = SampleReader(signals, base or (0.0, 1.0), out)
        file.notes += reader.read(rows)
        file.period_s, file.is_sampled = reader.period_s, True
    else:
        read_passages(columns, signals, rows, out)
        clocks = {signal.clock for signal in signals}
        file.is_wide |= len(clocks) > 1 and not any(clock.run for clock in clocks)
    file.notes += [make_reason("columns_unused", columns=unused)] if unused else []
    is_plain = not (file.is_sampled or file.is_wide)
    title = " ".join(block.headings[0].texts) if block.headings and not file.is_sampled else ""
    for (run, _), events in out.by_part.items():
        if is_plain and not {"edge", "state", "cleared", "gate", "run"} & roles:
            _check_moments(events, unused, problems)
        pieces = [events] if "run" in roles or not is_plain else _split(events, problems)
        file.parts += [FilePart(run or title, run, piece) for piece in pieces]
    file.rows += out.rows
    file.unread += out.unread


def _check_moments(events: Sequence[TimerEvent], unused: str, problems: ProblemList) -> None:
    """Refuse numbers that are no moments of a passage: durations, or samples of something else."""
    steps = [b.tick - a.tick for a, b in itertools.pairwise(events)]
    backwards = sum(step < 0 for step in steps)
    if backwards > 1 and backwards * 4 > len(events):
        numbers = "these numbers go up and down: they"
        problems.refuse(events[0].line, 1, "durations", numbers=numbers)
    if unused and len(steps) > 3 and max(steps) < 1.5 * min(steps):
        problems.refuse(events[0].line, 1, "regular_samples", columns=unused)


def _split(events: Sequence[TimerEvent], problems: ProblemList) -> list[list[TimerEvent]]:
    """Divide what stands one below the other where the times of an input do not go on."""
    pieces, last = [list[TimerEvent]()], dict[str, int]()
    # Where each row has a single time, one before any above it begins anew.
    in_order = len({event.line for event in events}) == len(events)
    for event in events:
        latest = max(last.values(), default=0) if in_order else last.get(event.label, 0)
        if event.label in last and event.tick < latest:
            pieces.append([])
            last = {}
        last[event.label] = event.tick
        pieces[-1].append(event)
    for before, piece in itertools.pairwise(pieces):
        if min(len(before), len(piece)) == 1:
            line, text = piece[0].line, f"{piece[0].tick / TICK_HZ:.9g}"
            problems.add(line, 1, "time", "backwards", text=text)
    return pieces
