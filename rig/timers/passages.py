"""Rows of a timer's table as passages: when, at which input, and whether the beam got dark."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from datetime import date
from typing import TYPE_CHECKING, NamedTuple

from rig.timers.edges_csv import TICK_HZ, picoseconds
from rig.timers.table import CLOCK
from rig.timers.vocabulary import number_of, state_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row, RowBlock, Table

_DAY_S = 86400


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
    line
        Of the file.
    """

    tick: int
    label: str
    blocked: bool | None = None
    high: bool | None = None
    line: int = 0


@dataclass(slots=True)
class Group:
    """Passages that stand together: those of a run, or of a gate.

    Attributes
    ----------
    name
        What the file calls it; empty where nothing is said.
    number
        Of the run, where the file says it; else 0.
    """

    name: str = ""
    number: int = 0
    passages: list[Passage] = field(default_factory=list)


class _Stream(NamedTuple):
    """A column of times with the column that says what they did; of an input, and of a run."""

    time: TimerColumn
    state: TimerColumn | None
    label: str
    run: str


def streams_of(columns: Sequence[TimerColumn]) -> list[_Stream]:
    """Give each column of times the states that belong to it: of its run, and of its input."""
    streams = []
    all_times = [column for column in columns if column.role == "time"]
    for time in all_times:
        beside = [other for other in all_times if other.run == time.run]
        states = [c for c in columns if c.role == "state" and (
            c.run == time.run or not c.run or not time.run)]  # fmt: skip
        if len(beside) > 1:
            like = [state for state in states if time.gate and state.gate == time.gate]
            nearest = {min(beside, key=lambda t: (t.at > s.at, abs(t.at - s.at))).at: s
                       for s in states}  # fmt: skip
            states = like or [state for at, state in nearest.items() if at == time.at]
        if len(states) < 2:
            state = next(iter(states), None)
            label = time.gate or (state.gate if state and len(beside) > 1 else "")
            plain = state is None and time.blocked is None and not time.run
            if plain and label and label in time.name:
                label = time.name
            streams.append(_Stream(time, state, label, time.run))
        else:
            streams += [_Stream(time, state, state.gate or state.name, time.run or state.run)
                        for state in states]  # fmt: skip
    return streams


class RowReader:
    """Reads the rows of passages of a block, run by run.

    Attributes
    ----------
    groups
        What was read, by run.
    silent
        Lines that only say that nothing changes.
    """

    def __init__(
        self, block: RowBlock, columns: Sequence[TimerColumn], table: Table, problems: ProblemList
    ) -> None:
        roles = {column.role: column.at for column in columns}
        self.groups: dict[object, Group] = {}
        self.silent: set[int] = set()
        self._run, self._gate, self._edge = roles.get("run"), roles.get("gate"), roles.get("edge")
        self._streams = streams_of(columns)
        self._table, self._problems = table, problems
        self._states: dict[tuple[object, str], bool] = {}
        self._several = len(self._streams) > 1 and any(s.state for s in self._streams)
        self._row_is_run = self._is_row_a_run(block)
        for line in block.rows:
            self._read_row(table.row(line))

    def _is_row_a_run(self, block: RowBlock) -> bool:
        """Whether times that stand side by side are one drop: a row each, gate after gate."""
        times = [stream.time for stream in self._streams]
        if len(times) < 2 or self._gate is not None or any(s.state for s in self._streams):
            return False
        if any(time.run for time in times) or self._edge is not None:
            return False
        if not all(time.gate or time.numbered or time.blocked is not None for time in times):
            return False
        if len(block.rows) == 1 or self._run is not None:
            return True
        firsts = [self._table.row(line).cell(times[0].at) for line in block.rows]
        ticks = [picoseconds(self._table.with_point(text)) or 0 for text in firsts if text]
        return any(time.numbered and not time.gate for time in times) or ticks != sorted(ticks)

    def _read_row(self, row: Row) -> None:
        number = self._whole(row, self._run)
        for stream in self._streams:
            text = row.cell(stream.time.at)
            if not text:
                continue
            label = stream.label if self._gate is None else row.cell(self._gate)
            key: tuple[object, ...] = (number, stream.run)
            if self._row_is_run:
                zero = picoseconds(self._table.with_point(text)) == 0
                if zero and stream is not self._streams[0]:  # nothing was there
                    continue
                key, name = (number, row.line), stream.time.name
                label = label or (name if stream.time.numbered and name[:1] in "tTZ" else "")
            elif not label and not stream.run:
                key = (number, stream.time.at)
            run = stream.run
            group = self.groups.setdefault(key, Group(run, number or number_of(run) or 0))
            self._add(row, stream, text, label, group)

    def _add(self, row: Row, stream: _Stream, text: str, label: str, group: Group) -> None:
        time = moment(text, self._table, stream.time.power or 0)
        if time is None or abs(time) >= 10**24:
            self._reject(row, stream.time.at, "time", "a time that a drop can have")
            return
        blocked, high = stream.time.blocked, None
        if stream.state is not None:
            said = row.cell(stream.state.at)
            if self._several and not said:
                return  # another input's row
            blocked = _is_yes(said, "blocked", "clear")
            if blocked is None:
                self._reject(row, stream.state.at, "state", "a state: 1 or blocked, 0 or unblocked")
                return
            # Where each row has the states of all inputs, most of them are as they were.
            whole = self._several and all(
                row.cell(s.state.at) for s in self._streams if s.state and s.run == stream.run
            )
            before = self._states.get((id(group), label), False)
            self._states[id(group), label] = blocked
            begins = not group.passages and not blocked and time == 0
            if (whole and before is blocked) or begins:
                self.silent.add(row.line)
                return
        elif self._edge is not None:
            high = _is_yes(row.cell(self._edge), "high", "low")
            if high is None:
                self._reject(row, self._edge, "edge", "an edge: rising or falling")
                return
        lasting_s = abs(time - group.passages[0].tick) / TICK_HZ if group.passages else 0.0
        if stream.time.power is not None and lasting_s > _DAY_S:
            values = {"recording": "the recording", "lasting_s": lasting_s, "limit_s": _DAY_S}
            place = row.line, self._table.column(row.line, stream.time.at), "time"
            self._problems.add(*place, "too_long", **values)
        group.passages.append(Passage(time, label, blocked, high, row.line))

    def _whole(self, row: Row, at: int | None) -> int:
        if at is None:
            return 0
        number = number_of(row.cell(at))
        if number is None:
            self._reject(row, at, "run", "a whole number")
        return number or 0

    def _reject(self, row: Row, at: int, key: str, accepted: str) -> None:
        place = self._table.column(row.line, at)
        self._problems.reject(row.line, place, key, row.cell(at), accepted)


def moment(text: str, table: Table, power: int) -> int | None:
    """Read a time as picoseconds: a number, or a date with its time of day."""
    match = CLOCK.fullmatch(text) if ":" in text else None
    if match is None:
        return picoseconds(table.with_point(text), -power)
    first, mark, second, third, hours, minutes, rest = match.groups()
    day, seconds = 0, picoseconds(rest.replace(",", "."))
    if first:
        # Only how many days lie between two times matters: which part is the year is enough.
        parts = [int(first), int(second), int(third)]
        year, month, of_month = parts if len(first) > 2 else parts[::-1]
        if mark == "/" and parts[0] <= 12:
            month, of_month = parts[0], parts[1]
        try:
            day = date(year, month, of_month).toordinal()
        except ValueError:
            return None
    return ((day * 24 + int(hours or 0)) * 60 + int(minutes)) * 60 * TICK_HZ + (seconds or 0)


def _is_yes(text: str, yes: str, no: str) -> bool | None:
    state = state_of(text)
    return True if state in {yes, "one"} else False if state in {no, "zero"} else None


def split_at_jumps(group: Group, *, in_order: bool) -> list[Group]:
    """Part what stands one below the other where the times of an input do not go on.

    Parameters
    ----------
    in_order
        Whether each row has a single time, so that a time before any above it begins anew; gates
        may stand one after the other all the same.
    """
    parts, last = [Group(group.name, group.number)], dict[str, int]()
    for passage in group.passages:
        latest = max(last.values(), default=0) if in_order else last.get(passage.label, 0)
        if passage.label in last and passage.tick < latest:
            parts.append(Group(group.name))
            last = {}
        last[passage.label] = passage.tick
        parts[-1].passages.append(passage)
    return parts


def widest_pause(ticks: Sequence[int]) -> int:
    """Return the pause, ps, at which drops one after the other are parted; 0 where there is none.

    Between drops nothing passes for far longer than ever within one: the pauses in order, the
    widest step from one to the next, by a factor of 3 at least, up to half a second or more.
    """
    pauses = sorted(b - a for a, b in itertools.pairwise(ticks))
    steps = [
        (b / max(a, TICK_HZ // 1000), b) for a, b in itertools.pairwise(pauses) if 2 * b >= TICK_HZ
    ]
    ratio, pause = max(steps, default=(0.0, 0))
    return pause if ratio >= 3.0 else 0
