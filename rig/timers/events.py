"""Rows of a timer's table as events: when, at which input, and what the beam or signal did."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.timers.columns import Signal, TimerColumn, find_signals, roles
from rig.timers.edge_rows import HEADER
from rig.timers.moments import TICK_HZ, moment, picoseconds, seconds
from rig.timers.vocabulary import number_of, state_of

if TYPE_CHECKING:
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
_DAY_S, _HOUR_S = 86400, 3600
"""How long a recording may be, and a run: an hour in a run means a wrong unit or a wrong run."""


class TimerEvent(NamedTuple):
    """One change at one input.

    Attributes
    ----------
    tick
        In picoseconds.
    label
        What the file calls the input; empty where it does not say.
    state
        What begins with it: ``blocked`` or ``clear``; ``high`` or ``low`` where only the signal is
        known; empty where the file does not say.
    line
        Of the file.
    """

    tick: int
    label: str
    state: str = ""
    line: int = 0


@dataclass(slots=True)
class FilePart:
    """Events that stand together: those of a run, or of a gate.

    Attributes
    ----------
    name
        What the file calls it; empty where nothing is said.
    number
        Of the run, where the file says it; else 0.
    """

    name: str = ""
    number: int = 0
    events: list[TimerEvent] = field(default_factory=list)


class RowReader:
    """Reads the rows of a block, run by run.

    Parameters
    ----------
    columns
        What each column is.
    sample
        The first rows, which tell whether a row is a run.
    problems
        Where faults are noted.
    is_own
        Whether the rows are of the project's own format.

    Attributes
    ----------
    signals
        What is read.
    parts
        What was read, by run.
    rows
        How many rows there are.
    unread
        Lines of those that neither change anything nor say that nothing changes.
    has_runs
        Whether the file says of which run a row is.
    """

    def __init__(
        self,
        columns: Sequence[TimerColumn],
        sample: Sequence[Row],
        problems: ProblemList,
        is_own: bool,
    ) -> None:
        self.signals, self.problems, self._is_own = find_signals(columns), problems, is_own
        self.parts: dict[object, FilePart] = {}
        self.rows, self.unread, self._count = 0, list[int](), 0
        self._columns = {column.role: column for column in columns}
        self._last: dict[object, TimerEvent] = {}
        self._several = len(self.signals) > 1 and any(s.value for s in self.signals)
        self._row_is_run = self._is_row_a_run(sample)
        self.has_runs = self._row_is_run or "run" in self._columns

    def read(self, rows: Iterable[Row]) -> None:
        """Read rows; each gives events, or says that nothing changes, or is unread."""
        for self.rows, row in enumerate(rows, 1):
            if (self._is_own and self._has_fault(row)) or not list(self._read_row(row)):
                self.unread.append(row.line)

    def put(self, key: object, name: str, number: int, event: TimerEvent) -> None:
        """Add an event to the part with a key, which the file calls by a name, or a number."""
        if key not in self.parts:
            self.parts[key] = FilePart(name, number or number_of(name) or 0)
        self.parts[key].events.append(event)
        self._count += 1
        if self._count > MAX_EVENTS:
            self.problems.refuse(event.line, 1, "too_many_events", limit=MAX_EVENTS)

    def read_cell(
        self, row: Row, column: TimerColumn | None, read: Callable[[str], Any], absent: Any
    ) -> Any:
        """Return a cell's value; `None`, and a fault is noted, where it is not accepted."""
        if column is None:
            return absent
        _, form, accepted, _ = roles()["own " * self._is_own + column.role]
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        is_formed = form == ".*" or re.fullmatch(form, text)
        value = read(row.cell(column.at)) if is_formed else None
        if value is None:
            key = column.name if self._is_own else column.role
            self.problems.reject(row.line, row.column(column.at), key, text, accepted)
        return value

    def read_time(self, row: Row, clock: TimerColumn) -> int | None:
        """Return the time of a row, ps."""
        tick: int | None = self.read_cell(row, clock, partial(moment, power=clock.power or 0), None)
        return tick

    def _is_row_a_run(self, sample: Sequence[Row]) -> bool:
        """Whether times that stand side by side are one drop: a row each, gate after gate."""
        times = [signal.clock for signal in self.signals if signal.clock]
        is_open = any(t.run or not (t.gate or t.numbered or t.state) for t in times)
        if len(times) < 2 or {"gate", "edge"} & set(self._columns) or self._several or is_open:
            return False
        is_counted = "run" in self._columns or any(t.numbered and not t.gate for t in times)
        firsts = [picoseconds(text) or 0 for row in sample if (text := row.cell(times[0].at))]
        return len(sample) == 1 or is_counted or firsts != sorted(firsts)

    def _has_fault(self, row: Row) -> bool:
        """Whether a row of the project's own format has other than four values."""
        width = {"values": len(row.texts), "needed": len(HEADER), "header": ",".join(HEADER)}
        is_open, is_wide = row.raw.count('"') % 2 > 0, len(row.texts) != len(HEADER)
        if is_open or is_wide:
            code = "open_quote" if is_open else "wrong_width"
            self.problems.add(row.line, 1, "", code, **({} if is_open else width))
        return is_open or is_wide

    def _read_row(self, row: Row) -> Iterator[bool]:
        """Add the events of a row; yield whether each is one, and no state as it was."""
        number = self.read_cell(row, self._columns.get("run"), number_of, 0)
        label = self.read_cell(row, self._columns.get("gate"), str, "")
        words = [row.cell(signal.value.at) if signal.value else "" for signal in self.signals]
        is_whole = self._several and all(words)
        for n, (signal, word) in enumerate(zip(self.signals, words, strict=True)):
            clock, text = signal.clock, row.cell(signal.clock.at) if signal.clock else ""
            if clock is None or (not text and not self._is_own):
                continue
            if (self._row_is_run and n and not picoseconds(text)) or (
                signal.value and self._several and not word
            ):
                continue  # another input's row
            tick = self.read_time(row, clock)
            read = partial(_state_in, signal.value.role if signal.value else "")
            state = self.read_cell(row, signal.value, read, clock.state)
            if None not in (number, label, tick, state):
                event = TimerEvent(tick or 0, label or signal.label, state, row.line)
                yield self._add(row, signal, clock, event, number, is_whole)

    def _add(
        self,
        row: Row,
        signal: Signal,
        clock: TimerColumn,
        event: TimerEvent,
        number: int,
        is_whole: bool,
    ) -> bool:
        """Add an event; return whether it is one, and no state as it was."""
        key: tuple[object, ...] = number, signal.run
        if self._row_is_run:
            is_passage = clock.numbered and clock.name[:1] in "tTZ"
            event = event._replace(label=event.label or clock.name * is_passage)
            key = number, row.line
        elif not event.label and not signal.run:
            key = number, clock
        last = self._last.get((key, event.label))
        # Where each row has the states of all inputs, most of them are as they were.
        is_start = not (key in self.parts or event.tick or self._is_own) and event.state == "clear"
        if is_start or (is_whole and event.state == (last.state if last else "clear")):
            return False
        if self._is_in_time(row, clock, event, key, last or event):
            self._last[key, event.label] = event
            self.put(key, signal.run, number, event)
        return True

    def _is_in_time(
        self, row: Row, column: TimerColumn, event: TimerEvent, key: object, last: TimerEvent
    ) -> bool:
        """Whether a time can be of its run; within a numbered one, those of an input go on."""
        part = self.parts.get(key)
        number, first = (part.number, part.events[0]) if part else (0, event)
        lasting_s = abs(event.tick - first.tick) / TICK_HZ
        limit_s = _HOUR_S if self._is_own else _DAY_S
        is_long = column.power is not None and lasting_s > limit_s
        is_early = event.tick < last.tick and self.has_runs and not self._row_is_run
        if is_long or is_early:
            place = row.line, row.column(column.at), column.name if self._is_own else column.role
            recording = f"run {number}" if self._is_own else "the recording"
            values = {"recording": recording, "lasting_s": lasting_s, "limit_s": limit_s}
            before = {"last": seconds(last.tick, Fraction(TICK_HZ)), "text": row.cell(column.at)}
            before |= {"channel": event.label}
            code, said = (
                ("too_long", values) if is_long else ("before_last", {**before, "run": number})
            )
            self.problems.add(*place, code, **said)
        return not (is_long or is_early)


@lru_cache(1000)
def _state_in(role: str, word: str) -> str | None:
    """Return what a word means in a column of that role; nothing if unknown, `None` if no state."""
    accepted, state = roles()[role][-1].split(), state_of(word)
    state = dict(zip(("zero", "one"), accepted, strict=False)).get(state, state)
    return state if state in accepted else None
