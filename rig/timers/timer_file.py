"""A timer's file: its events, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps), oscilloscopes (volts), and the
project's own format, which leaves nothing open. What a file does not say (which gate, which level
is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
import statistics
from array import array
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rig.reasons import make_reason
from rig.timers.columns import columns_of
from rig.timers.events import FilePart, RowReader, split_at_jumps
from rig.timers.lines import read_lines
from rig.timers.moments import TICK_HZ, moment
from rig.timers.problems import ProblemList
from rig.timers.signals import find_threshold, volts_of
from rig.timers.table import HEADER, RowBlock, Table, find_time_base
from rig.timers.vcd import is_vcd, vcd_columns, vcd_rows
from rig.timers.vocabulary import LONGEST, number_of, recognise_format

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator, Sequence

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

    def add(self, reader: RowReader, parts: Iterable[FilePart]) -> None:
        """Add the parts of a block, and count its rows."""
        self.parts += parts
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
        reader = RowReader(columns, [], problems, is_own=False)
        reader.read(vcd_rows(numbered, columns, problems))
        file.add(reader, reader.parts.values())
        file.period_s = 10.0 ** -(columns[0].power or 0)
    else:
        _TableReader(path, lines, problems, file, unit).read()
        name = recognise_format(line[:LONGEST] for line in head)
        file.kind += f"; it looks like {name}" if name else ""
    problems.raise_if_any()
    file.parts = [part for part in file.parts if part.events]
    if not file.parts:
        notes = "".join(f"; {note}" for note in file.notes)
        problems.refuse(1, 1, "nothing_passes" if file.rows else "no_edges", notes=notes)
    return file


class _TableReader:
    """Reads the blocks of a table one after the other; the parameters are of `read_timer_file`."""

    def __init__(
        self,
        path: str | os.PathLike[str],
        lines: Iterator[str],
        problems: ProblemList,
        file: TimerFile,
        unit: str | None,
    ) -> None:
        self._path, self._problems, self._file, self._unit = path, problems, file, unit
        self._table = table = Table(lines)
        file.is_own = table.is_own
        if table.is_own:
            problems.hint = ""  # its faults are told each
            file.kind = f"the project's own format: {','.join(HEADER)}"
        else:
            file.kind = f"a table, its cells separated by {_SEPARATORS[table.separator]}"

    def read(self) -> None:
        """Add what all blocks say."""
        above = RowBlock()
        for n, (block, rows) in enumerate(self._table.blocks()):
            sample = list(itertools.islice(rows, _SAMPLE))
            columns = self._read_columns(block, above, sample)
            reader = RowReader(columns, sample, self._problems, is_own=self._table.is_own)
            self._set_base(reader, block, sample, columns)
            self._set_thresholds(reader, n)
            reader.read(itertools.chain(sample, rows))
            self._problems.raise_if_any()
            unused = ", ".join(
                column.name for column in columns if column.role in {"other", "duration"}
            )
            if reader.is_sampled:
                self._add_samples(reader, sample)
            else:
                self._add_passages(reader, block, columns, unused)
            if unused:
                self._file.notes.append(make_reason("columns_unused", columns=unused))
            above = block
        self._file.rows += self._table.stray_count
        self._file.unread += self._table.strays

    def _read_columns(
        self, block: RowBlock, above: RowBlock, sample: Sequence[Row]
    ) -> list[TimerColumn]:
        """Return the columns of a block; one without a heading has that of the block above."""
        width, own = max(len(row.texts) for row in sample), block.headings
        if width > MAX_COLUMNS:
            values = {"columns": width, "limit": MAX_COLUMNS}
            self._problems.refuse(sample[0].line, 1, "too_many_columns", **values)
        if self._table.is_own and tuple(text.lower() for text in own[0].texts) != HEADER:
            self._problems.refuse(own[0].line, 1, "wrong_header", header=",".join(HEADER))
        is_named = any(len(row.texts) > 1 or width == 1 for row in own)
        if not is_named or (above.headings and all(len(row.texts) != width for row in own)):
            block.headings = [*own, *above.headings]
        columns = columns_of(block, sample, self._table, self._unit, self._problems)
        self._problems.raise_if_any()
        self._file.columns |= {column.name: column.meaning for column in columns}
        self._file.has_unit &= all(column.power is not None for column in columns)
        return columns

    def _set_base(
        self, reader: RowReader, block: RowBlock, sample: list[Row], columns: list[TimerColumn]
    ) -> None:
        """Set when samples without times begin, and the time between them; refuse other rows."""
        if any(column.role == "time" for column in columns):
            return
        stated = find_time_base([*self._table.remarks, *block.headings])
        durations = ", ".join(repr(c.name) for c in columns if c.role == "duration")
        if reader.is_sampled and stated is None:
            self._problems.refuse(sample[0].line, 1, "no_rate", lacks="a column of times or a rate")
        elif not reader.is_sampled:
            code = "durations" if durations else "no_time_column"
            self._problems.refuse((block.headings or sample)[0].line, 1, code, numbers=durations)
        reader.base = stated or reader.base

    def _set_thresholds(self, reader: RowReader, n: int) -> None:
        """Find the levels of volts, for which all rows of the n-th block are read beforehand."""
        volts = {s: array("f") for s in reader.signals if s.value and s.value.role == "volts"}
        blocks = Table(read_lines(self._path)).blocks() if volts else iter(())
        for _, rows in itertools.islice(blocks, n, n + 1):
            places = [(s.value.at, values) for s, values in volts.items() if s.value]
            for row in rows:
                for at, values in places:
                    value = volts_of(row.cell(at))
                    if value is not None:
                        values.append(value)
        for signal, values in volts.items():
            signal.threshold = find_threshold(np.asarray(values))
            if signal.threshold is None:
                span = {"low": min(values), "high": max(values)}
                self._file.notes.append(make_reason("no_passage", input=signal.label, **span))

    def _add_samples(self, reader: RowReader, sample: list[Row]) -> None:
        """Add what samples say, and the time between them where it is always the same."""
        file, clock, steps = self._file, reader.signals[0].clock, [TICK_HZ]
        file.add(reader, reader.parts.values())
        if clock:
            ticks = [moment(row.cell(clock.at), clock.power or 0) or 0 for row in sample]
            steps = [b - a for a, b in itertools.pairwise(ticks)] or [0]
        file.is_regular = max(steps) < 1.5 * statistics.median(steps)
        if file.is_regular:
            file.period_s = statistics.median(steps) / TICK_HZ * reader.base[1]
        counts = Counter(event.label for part in reader.parts.values() for event in part.events)
        for signal in reader.signals:
            if signal.threshold:
                values = {"input": signal.label, "level": signal.threshold.centre}
                crossings = counts[signal.label]
                file.notes.append(make_reason("crossings", crossings=crossings, **values))

    def _add_passages(
        self, reader: RowReader, block: RowBlock, columns: Sequence[TimerColumn], unused: str
    ) -> None:
        """Add passages, divided where times begin anew; refuse what is no moment of a passage."""
        roles = {column.role for column in columns}
        is_stated = bool({"edge", "state", "gate", "run"} & roles)
        mark = " ".join(block.headings[0].texts) if block.headings else ""
        for part in reader.parts.values():
            lines = [event.line for event in part.events]
            if len(set(lines)) == 1:  # columns of a row may stand in any order
                part.events.sort(key=lambda event: event.tick)
            steps = [b.tick - a.tick for a, b in itertools.pairwise(part.events)]
            backwards = sum(step < 0 for step in steps)
            if not is_stated and backwards > 1 and backwards * 4 > len(lines):
                self._problems.refuse(
                    lines[0], 1, "durations", numbers="these numbers go up and down: they"
                )
            is_regular = len(steps) > 3 and max(steps) < 1.5 * min(steps)
            if "other" in roles and not is_stated and is_regular:
                self._problems.refuse(lines[0], 1, "regular_samples", columns=unused)
            part.name, in_order = part.name or mark, len(set(lines)) == len(lines)
            pieces = [part] if reader.has_runs else split_at_jumps(part, in_order=in_order)
            for before, piece in itertools.pairwise(pieces):
                if min(len(before.events), len(piece.events)) == 1:
                    line, text = piece.events[0].line, f"{piece.events[0].tick / TICK_HZ:.9g}"
                    self._problems.add(line, 1, "time", "backwards", text=text)
            self._file.parts += pieces
        self._file.add(reader, [])
