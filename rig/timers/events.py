"""Rows of a timer's table as events: when, at which input, and what the beam or signal did."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache, partial
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from rig.boards import GATES
from rig.timers.moments import TICK_HZ, moment, picoseconds, seconds
from rig.timers.signals import find_signals, volts_of
from rig.timers.table import HEADER
from rig.timers.vocabulary import number_of, state_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.signals import Signal
    from rig.timers.table import Row

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
_LISTED = 100
"""Lines that are named, at most."""
_DAY_S, _HOUR_S = 86400, 3600
"""How long a recording may be, and a run: an hour in a run means a wrong unit or a wrong run."""
_ANY = ".*"
_ACCEPTED = {
    "run": (_ANY, "a whole number"),
    "gate": (_ANY, "an input"),
    "time": (_ANY, "a time that a drop can have"),
    "index": (_ANY, "a number of the sample"),
    "state": (_ANY, "a state: 1 or blocked, 0 or unblocked"),
    "edge": (_ANY, "an edge: rising or falling"),
    "level": (_ANY, "a level: 0 or 1"),
    "volts": (_ANY, "a number of volts"),
}
"""What a cell may look like, by the role of its column, and what is accepted there."""
_OWN = {
    "run": ("[+]?0*[1-9][0-9]{0,8}", "a run: a whole number from 1"),
    "gate": ("|".join(map(str, range(GATES))), f"a channel: 0 to {GATES - 1}"),
    "time": ("[^:]+", "a time of a drop in seconds"),
    "state": ("[01]", "a state: 1 is blocked, 0 is clear"),
}
"""The same of the project's own format."""
_STATES = {"state": ("clear", "blocked"), "edge": ("low", "high"), "level": ("low", "high")}
"""What 0 and 1 mean in a column of states, of edges of a signal, or of levels."""


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
    base
        Of samples without times: when the first was taken, and the time between them, s.
    signals
        What is read, and whether it is sampled.
    parts
        What was read, by run.
    rows, silent
        How many rows there are, and how many of them only say that nothing changes.
    unread
        Lines of the first rows that say neither.
    row_is_run, has_runs
        Whether each row is a run, and whether the file says of which run a row is.
    """

    def __init__(
        self,
        columns: Sequence[TimerColumn],
        sample: Sequence[Row],
        problems: ProblemList,
        is_own: bool,
    ) -> None:
        self.base = (0.0, 1.0)
        self.signals = find_signals(columns)
        self.is_sampled = any(signal.is_sampled for signal in self.signals)
        self.parts: dict[object, FilePart] = {}
        self.rows = self.silent = self._events = 0
        self.unread: list[int] = []
        self._columns = {column.role: column for column in columns}
        self._problems, self._is_own = problems, is_own
        self._forms = _OWN if is_own else _ACCEPTED
        self._last: dict[object, TimerEvent] = {}
        self._before: dict[TimerColumn | None, tuple[int, list[str]]] = {}
        self._several = len(self.signals) > 1 and any(s.value for s in self.signals)
        self.row_is_run = self._is_row_a_run(sample)
        self.has_runs = self.row_is_run or "run" in self._columns
        by_clock = groupby(self.signals, key=lambda signal: signal.clock)
        self._clocks = [(clock, list(signals)) for clock, signals in by_clock]
        self._skips_blanks = not is_own and not (self.is_sampled and len(self._clocks) == 1)

    def read(self, rows: Iterable[Row]) -> None:
        """Read rows; each gives events, or says that nothing changes, or is unread."""
        for row in rows:
            before, is_faulty = self._events, self._is_own and self._has_fault(row)
            is_silent = not is_faulty and self._read_row(row)
            self.rows += 1
            if self._events == before:
                self.silent += is_silent
                self.unread += [row.line] * (not is_silent and len(self.unread) < _LISTED)
            elif self._events > MAX_EVENTS:
                self._problems.refuse(row.line, 1, "too_many_events", limit=MAX_EVENTS)

    def _is_row_a_run(self, sample: Sequence[Row]) -> bool:
        """Whether times that stand side by side are one drop: a row each, gate after gate."""
        times = [signal.clock for signal in self.signals if signal.clock]
        is_open = any(t.run or not (t.gate or t.numbered or t.blocked is not None) for t in times)
        if len(times) < 2 or {"gate", "edge"} & set(self._columns) or self._several or is_open:
            return False
        is_counted = "run" in self._columns or any(t.numbered and not t.gate for t in times)
        firsts = [picoseconds(text) or 0 for row in sample if (text := row.cell(times[0].at))]
        return len(sample) == 1 or is_counted or firsts != sorted(firsts)

    def _has_fault(self, row: Row) -> bool:
        """Whether a row of the project's own format has other than four values."""
        if row.raw.count('"') % 2:
            self._problems.add(row.line, 1, "", "open_quote")
        elif len(row.texts) != len(HEADER):
            accepted = {"needed": len(HEADER), "header": ",".join(HEADER)}
            self._problems.add(row.line, 1, "", "wrong_width", values=len(row.texts), **accepted)
        else:
            return False
        return True

    def _read_row(self, row: Row) -> bool:
        """Add the events of a row; return whether it says that something is as it was."""
        run, gate = self._columns.get("run"), self._columns.get("gate")
        number = self._read_cell(row, run, number_of) if run else 0
        label = self._read_cell(row, gate, str) if gate and not self.is_sampled else ""
        is_silent = False
        for clock, signals in self._clocks:
            text = row.cell(clock.at) if clock else ""
            is_later = self.row_is_run and signals[0] is not self.signals[0]
            if (self._skips_blanks and not text) or (is_later and not picoseconds(text)):
                continue
            tick = self._read_tick(row, clock)
            words = [row.cell(signal.value.at) if signal.value else "" for signal in signals]
            is_early = clock not in self._before and not any(words)  # before the first sample
            if self.is_sampled and (
                tick is None or is_early or not self._is_news(row, clock, tick, words)
            ):
                is_silent = True
                continue
            is_whole = self._several and all(words)
            for signal, word in zip(signals, words, strict=True):
                if signal.value and self._several and not (word or self.is_sampled):
                    continue  # another input's row
                level = self._read_state(row, signal, word, tick or 0)
                if self.is_sampled and not signal.is_news(level):
                    is_silent = True
                elif None not in (number, label, tick, level):
                    event = TimerEvent(tick or 0, label or signal.label, level or "", row.line)
                    is_silent |= not self._add(row, signal, event, number or 0, is_whole)
        return is_silent

    def _read_cell(self, row: Row, column: TimerColumn, read: Callable[[str], Any]) -> Any:
        """Return a cell's value; `None`, and a fault is noted, where it is not accepted."""
        form, accepted = self._forms[column.role]
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        value = read(row.cell(column.at)) if form == _ANY or re.fullmatch(form, text) else None
        if value is None:
            key = column.name if self._is_own else column.role
            self._problems.reject(row.line, row.column(column.at), key, text, accepted)
        return value

    def _read_tick(self, row: Row, clock: TimerColumn | None) -> int | None:
        read = partial(moment, power=(clock and clock.power) or 0)
        tick: int | None = self._read_cell(row, clock, read) if clock else self.rows * TICK_HZ
        if tick is not None and self.base != (0.0, 1.0):
            return round(TICK_HZ * self.base[0] + tick * self.base[1])
        return tick

    def _is_news(self, row: Row, clock: TimerColumn | None, tick: int, words: list[str]) -> bool:
        """Whether a sample says more than the one before, which has to be earlier."""
        before, last = self._before.get(clock, (tick, []))
        if tick < before and clock:
            text = row.cell(clock.at)
            self._problems.add(row.line, row.column(clock.at), "time", "backwards", text=text)
        self._before[clock] = tick, words
        return words != last or "volts" in self._columns

    def _read_state(self, row: Row, signal: Signal, word: str, tick: int) -> str | None:
        """Return what begins: nothing where that is unknown, `None` where it is no state."""
        column = signal.value
        if column is None:
            return signal.state
        volts = volts_of(word) if column.role == "volts" else None
        if volts is not None:
            return signal.threshold.follow(tick, volts, row.line) if signal.threshold else ""
        return cast("str | None", self._read_cell(row, column, partial(_state_in, column.role)))

    def _add(
        self, row: Row, signal: Signal, event: TimerEvent, number: int, is_whole: bool
    ) -> bool:
        """Add an event; return whether it is one, and no state as it was."""
        clock, threshold, key = signal.clock, signal.threshold, (number, signal.run, "")
        if self.row_is_run and clock:
            is_passage = clock.numbered and clock.name[:1] in "tTZ"
            event = event._replace(label=event.label or clock.name * is_passage)
            key = (number, "", f"row {row.line}")
        elif clock and not event.label and not signal.run:
            key = (number, "", f"column {clock.at}")
        if threshold:
            event = event._replace(tick=threshold.tick, line=threshold.line)
        part = FilePart(signal.run, number or number_of(signal.run) or 0)
        part = self.parts.setdefault(key, part)
        last = self._last.get((key, event.label))
        is_start = not (part.events or event.tick or self._is_own) and event.state == "clear"
        # Where each row has the states of all inputs, most of them are as they were.
        if is_start or (is_whole and event.state == (last.state if last else "clear")):
            return False
        if self.is_sampled or self._is_in_time(row, signal, event, part, last or event):
            self._last[key, event.label] = event
            part.events.append(event)
            self._events += 1
        return True

    def _is_in_time(
        self, row: Row, signal: Signal, event: TimerEvent, part: FilePart, last: TimerEvent
    ) -> bool:
        """Whether a time can be of its run; within a numbered one, those of an input go on."""
        column, run = cast("TimerColumn", signal.clock), part.number
        lasting_s = abs(event.tick - (part.events or [event])[0].tick) / TICK_HZ
        limit_s, recording = (_HOUR_S, f"run {run}") if self._is_own else (_DAY_S, "the recording")
        key = column.name if self._is_own else column.role
        note = partial(self._problems.add, row.line, row.column(column.at), key)
        if column.power is not None and lasting_s > limit_s:
            note("too_long", recording=recording, lasting_s=lasting_s, limit_s=limit_s)
        elif event.tick < last.tick and self.has_runs and not self.row_is_run:
            before, text = seconds(last.tick, Fraction(TICK_HZ)), row.cell(column.at)
            note("before_last", last=before, channel=event.label, run=run, text=text)
        else:
            return True
        return False


@lru_cache(1000)
def _state_in(role: str, word: str) -> str | None:
    """Return what a word means in a column of that role; nothing if unknown, `None` if no state."""
    if role == "level" and (not word or word in "xXzZ"):
        return ""
    accepted, state = _STATES.get(role, ()), state_of(word)
    state = dict(zip(("zero", "one"), accepted, strict=False)).get(state, state)
    return state if state in accepted else None


def split_at_jumps(part: FilePart, *, in_order: bool) -> list[FilePart]:
    """Divide what stands one below the other where the times of an input do not go on.

    Parameters
    ----------
    in_order
        Whether each row has a single time, so that a time before any above it begins anew; gates
        may stand one after the other all the same.
    """
    parts, last = [FilePart(part.name, part.number)], dict[str, int]()
    for event in part.events:
        latest = max(last.values(), default=0) if in_order else last.get(event.label, 0)
        if event.label in last and event.tick < latest:
            parts.append(FilePart(part.name))
            last = {}
        last[event.label] = event.tick
        parts[-1].events.append(event)
    return parts


def widest_pause(ticks: Sequence[int]) -> int:
    """Return the pause, ps, at which drops one after the other are parted; 0 where there is none.

    Between drops nothing passes for far longer than ever within one: the pauses in order, the
    widest step from one to the next, by a factor of 3 at least, up to half a second or more.
    """
    pauses = sorted(b - a for a, b in pairwise(ticks))
    steps = [(b / max(a, TICK_HZ // 1000), b) for a, b in pairwise(pauses) if 2 * b >= TICK_HZ]
    ratio, pause = max(steps, default=(0.0, 0))
    return pause if ratio >= 3.0 else 0
