"""Rows of a timer's table as passages: when, at which input, and whether it got dark."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import date
from typing import TYPE_CHECKING, NamedTuple

from rig.timers.edges_csv import TICK_HZ, picoseconds
from rig.timers.table import BLOCKED, CLEAR, FALLING, RISING, as_state, with_point

if TYPE_CHECKING:
    from rig.timers.columns import Columns, TimeColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row, TableCell

MAX_SPAN_S = 60
"""A drop lasts half a second, and nobody waits a minute until it is recorded."""
_DAY_S = 86400
PAUSE_S = 3
"""Drops that stand one after the other are parted by more than this."""
_DATE = re.compile(
    r"([0-9]{4}-[0-9]{2}-[0-9]{2})[T ]([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]+)?)"
    r"(?:Z|[+-][0-9:]{4,6})?"
)


class Passage(NamedTuple):
    """One change at one input.

    Attributes
    ----------
    tick
        In picoseconds.
    label
        What the file calls the input; empty where it does not say.
    blocked
        Whether the beam is dark from then on; `None` where the file does not say.
    high
        Whether a signal is high from then on, where that is all that is said.
    """

    tick: int
    label: str
    blocked: bool | None = None
    high: bool | None = None


@dataclass(slots=True)
class _Run:
    """What was read of one run."""

    passages: list[Passage] = field(default_factory=list)
    last: dict[str, int] = field(default_factory=dict)
    states: dict[str, bool] = field(default_factory=dict)


class PassageRows:
    """Reads rows of passages, run by run."""

    def __init__(self, columns: Columns, separator: str, problems: ProblemList) -> None:
        self._columns = columns
        self._separator = separator
        self._problems = problems
        self._runs: dict[tuple[int, int], _Run] = {}
        self._backwards = 0
        self._rows = 0
        self._drops = 0

    def runs(self) -> list[tuple[int, list[Passage]]]:
        """Return each run's number, 0 where rows have none, and its passages."""
        return [(key[0], run.passages) for key, run in sorted(self._runs.items()) if run.passages]

    @property
    def up_and_down(self) -> bool:
        """Whether so many times are before those above them that they are none."""
        return self._backwards > 1 and self._backwards * 4 > self._rows

    def add(self, row: Row) -> None:
        """Read one row; runs that ended earlier have blanks."""
        columns = self._columns
        number = self._read_whole(row, columns.run, "run")
        if columns.row_is_run:
            key = (number, self._drops)
            self._drops += 1
            for column in columns.times:
                if not self._never(row, column):
                    self._time(row, column, key, column.label)
            return
        label = self._label(row)
        for beside, column in enumerate(columns.times):
            if column.label:  # side by side stand inputs, and not runs
                self._time(row, column, (number, 0), column.label)
            else:
                self._time(row, column, (number, beside), label)

    def _time(self, row: Row, column: TimeColumn, key: tuple[int, int], label: str) -> None:
        cell = row.cell(column.at)
        if not cell.text or cell.text.lower() == "nan":
            return
        time = moment(cell.text, self._separator, column.power)
        if time is None or abs(time) >= 10**12 * TICK_HZ:
            self._refuse(row, cell, "time", "a time that a drop can have")
            return
        blocked, high = column.blocked, None
        if column.state is not None:
            state = row.cell(column.state)
            if column.label and not state.text:
                return  # another input's row
            blocked = _read_state(state.text, BLOCKED, CLEAR)
            if blocked is None:
                self._refuse(row, state, "state", "a state: 1 or blocked, 0 or unblocked")
                return
        elif self._columns.edge is not None:
            edge = row.cell(self._columns.edge)
            high = _read_state(edge.text, RISING, FALLING)
            if high is None:
                self._refuse(row, edge, "edge", "an edge: rising or falling")
                return
        run = self._runs.setdefault(key, _Run())
        if column.state is not None and column.label and not self._changes(run, label, blocked):
            return
        before = run.last.get(label, time)
        lasting_s = (time - run.passages[0].tick) / TICK_HZ if run.passages else 0.0
        if lasting_s > _DAY_S:
            values = {"recording": "the recording", "lasting_s": lasting_s, "limit_s": _DAY_S}
            self._problems.add(row.line, cell.column, "time", "too_long", **values)
            return
        self._rows += 1
        if time < before:
            self._backwards += 1
            self._problems.add(row.line, cell.column, "time", "backwards", text=cell.text)
            return
        run.last[label] = time
        run.passages.append(Passage(time, label, blocked, high))

    def _never(self, row: Row, column: TimeColumn) -> bool:
        """Whether a time side by side was never reached: a zero after others."""
        zero = picoseconds(with_point(row.cell(column.at).text, self._separator)) == 0
        return zero and column is not self._columns.times[0]

    @staticmethod
    def _changes(run: _Run, label: str, blocked: bool | None) -> bool:
        """Whether an input's state is another one than above; beams begin clear."""
        changes = run.states.get(label, False) is not blocked
        run.states[label] = bool(blocked)
        return changes

    def _label(self, row: Row) -> str:
        at = self._columns.channel
        return "" if at is None else row.cell(at).text

    def _read_whole(self, row: Row, at: int | None, key: str) -> int:
        if at is None:
            return 0
        cell = row.cell(at)
        if not cell.text.isdecimal() or len(cell.text) > 6:
            self._refuse(row, cell, key, "a whole number")
            return 0
        return int(cell.text)

    def _refuse(self, row: Row, cell: TableCell, key: str, accepted: str) -> None:
        self._problems.reject(row.line, cell.column, key, cell.text, accepted)


def moment(text: str, separator: str, power: int) -> int | None:
    """Read a time as picoseconds: a number, or a date with its time of day."""
    match = _DATE.fullmatch(text)
    if match is None:
        return picoseconds(with_point(text, separator), -power)
    try:
        day = date.fromisoformat(match[1]).toordinal()
    except ValueError:
        return None
    seconds = picoseconds(match[4])
    assert seconds is not None
    return ((day * 24 + int(match[2])) * 60 + int(match[3])) * 60 * TICK_HZ + seconds


def _read_state(text: str, yes: set[str], no: set[str]) -> bool | None:
    text = as_state(text)
    return True if text in yes else False if text in no else None


def split_at_pauses(passages: list[Passage]) -> list[list[Passage]]:
    """Part drops that were recorded one after the other, at pauses longer than `PAUSE_S`.

    Only where all together last too long for one.
    """
    ordered = sorted(passages, key=lambda passage: passage.tick)
    if ordered[-1].tick - ordered[0].tick <= MAX_SPAN_S * TICK_HZ:
        return [passages]
    drops = [[ordered[0]]]
    for passage in ordered[1:]:
        if passage.tick - drops[-1][-1].tick > PAUSE_S * TICK_HZ:
            drops.append([])
        drops[-1].append(passage)
    return drops
