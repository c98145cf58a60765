"""Rows of a timer's table as events: when, at which input, and what the beam or signal did."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache, partial
from itertools import groupby, pairwise
from statistics import median
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
_SAMPLE = 200
"""Steps from one sample to the next that show which is usual."""
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
    base
        Of samples without times: when the first was taken, and the time between them, s.
    is_own
        Whether the rows are of the project's own format.

    Attributes
    ----------
    signals
        What is read, and whether it is sampled.
    parts
        What was read, by run.
    rows, silent
        How many rows there are, and how many of them only say that nothing changes.
    unread
        Lines of the first rows that say neither.
    has_runs
        Whether the file says of which run a row is, or each row is a run.
    """

    def __init__(
        self,
        columns: Sequence[TimerColumn],
        sample: Sequence[Row],
        problems: ProblemList,
        base: tuple[float, float] = (0.0, 1.0),
        *,
        is_own: bool = False,
    ) -> None:
        self.signals = find_signals(columns)
        self.is_sampled = any(signal.is_sampled for signal in self.signals)
        self.parts: dict[object, FilePart] = {}
        self.rows = self.silent = self._events = 0
        self.unread: list[int] = []
        self._columns = {column.role: column for column in columns}
        self._problems, self._base, self._is_own = problems, base, is_own
        self._last: dict[object, TimerEvent] = {}
        self._before: dict[TimerColumn | None, tuple[int, list[str]]] = {}
        self._steps: list[int] = []
        self._several = len(self.signals) > 1 and any(s.value for s in self.signals)
        self._row_is_run = self._is_row_a_run(sample)
        self.has_runs = self._row_is_run or "run" in self._columns
        by_clock = groupby(self.signals, key=lambda signal: signal.clock)
        self._clocks = [(clock, list(signals)) for clock, signals in by_clock]
        self._is_plain = self.is_sampled and len(self._clocks) == 1

    def read(self, rows: Iterable[Row]) -> None:
        """Read rows; each gives events, or says that nothing changes, or is unread."""
        for row in rows:
            before, is_faulty = self._events, self._is_own and not self._is_readable(row)
            silent = not is_faulty and self._read_row(row)
            self.rows += 1
            if self._events == before:
                self.silent += silent
                self.unread += [row.line] * (not silent and len(self.unread) < _LISTED)
            elif self._events > MAX_EVENTS:
                self._problems.refuse(row.line, 1, "too_many_events", limit=MAX_EVENTS)

    def period_s(self) -> float | None:
        """Return the time between samples, if all are as far apart as most of the first."""
        usual = median(self._steps[:_SAMPLE]) if self._steps else 0
        return usual / TICK_HZ if max(self._steps, default=0) < 1.5 * usual else None

    def _is_row_a_run(self, sample: Sequence[Row]) -> bool:
        """Whether times that stand side by side are one drop: a row each, gate after gate."""
        times = [signal.clock for signal in self.signals if signal.clock]
        if len(times) < 2 or {"gate", "edge"} & set(self._columns) or self._several:
            return False
        if any(t.run or not (t.gate or t.numbered or t.blocked is not None) for t in times):
            return False
        if len(sample) == 1 or "run" in self._columns:
            return True
        firsts = [picoseconds(text) or 0 for row in sample if (text := row.cell(times[0].at))]
        return any(t.numbered and not t.gate for t in times) or firsts != sorted(firsts)

    def _is_readable(self, row: Row) -> bool:
        """Whether a row of the project's own format has four values."""
        code, values = "", dict[str, object]()
        if row.raw.count('"') % 2:
            code = "open_quote"
        elif len(row.texts) != len(_OWN):
            code, values = "wrong_width", {"values": len(row.texts), "needed": len(_OWN)}
            values["header"] = ",".join(HEADER)
        if code:
            self._problems.add(row.line, 1, "", code, **values)
        return not code

    def _read_row(self, row: Row) -> bool:
        """Add the events of a row; return whether it says that something is as it was."""
        run, gate = self._columns.get("run"), self._columns.get("gate")
        number = self._read_cell(row, run, number_of) if run else 0
        label = self._read_cell(row, gate, str) if gate and not self.is_sampled else None
        silent = False
        for clock, signals in self._clocks:
            text = row.cell(clock.at) if clock else str(self.rows)
            is_later = self._row_is_run and signals[0] is not self.signals[0]
            if not (text or self._is_own or self._is_plain) or (is_later and not picoseconds(text)):
                continue
            tick = self._read_tick(row, clock)
            if tick is None and not self._is_own:  # all faults of its rows are told
                continue
            words = [row.cell(signal.value.at) if signal.value else "" for signal in signals]
            if self.is_sampled and not self._is_news(row, clock, tick or 0, words):
                silent = True
                continue
            is_whole = self._several and all(words)
            for signal, word in zip(signals, words, strict=True):
                level: str | None = signal.state
                if signal.value and (word or self.is_sampled or not self._several):
                    level = self._read_state(row, signal, word, tick or 0)
                elif signal.value:
                    level = None  # another input's row
                if self.is_sampled and not signal.is_news(level):
                    silent = True
                elif None not in (number, tick, level):
                    event = TimerEvent(tick or 0, label or signal.label, level or "", row.line)
                    silent |= not self._add(row, signal, event, number or 0, is_whole=is_whole)
        return silent

    def _read_cell(self, row: Row, column: TimerColumn, read: Callable[[str], Any]) -> Any:
        """Return a cell's value; `None`, and a fault is noted, where it is not accepted."""
        form, accepted = (_OWN if self._is_own else _ACCEPTED)[column.role]
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        value = read(row.cell(column.at)) if form == _ANY or re.fullmatch(form, text) else None
        if value is None:
            key = column.name if self._is_own else column.role
            self._problems.reject(row.line, row.column(column.at), key, text, accepted)
        return value

    def _read_tick(self, row: Row, clock: TimerColumn | None) -> int | None:
        if clock and clock.role == "time":
            return self._read_cell(row, clock, partial(moment, power=clock.power or 0))
        sample = self._read_cell(row, clock, picoseconds) if clock else self.rows * TICK_HZ
        return None if sample is None else round(TICK_HZ * self._base[0] + sample * self._base[1])

    def _is_news(self, row: Row, clock: TimerColumn | None, tick: int, words: list[str]) -> bool:
        """Whether a sample says more than the one before, which has to be earlier."""
        before, last = self._before.get(clock, (tick, []))
        if tick < before and clock:
            text = row.cell(clock.at)
            self._problems.add(row.line, row.column(clock.at), "time", "backwards", text=text)
        if len(self._steps) < _SAMPLE or tick - before > self._steps[-1]:
            self._steps.append(tick - before)
        self._before[clock] = tick, words
        return words != last or "volts" in self._columns

    def _read_state(self, row: Row, signal: Signal, word: str, tick: int) -> str | None:
        """Return what begins: nothing where that is unknown, `None` where it is no state."""
        column = cast("TimerColumn", signal.value)
        volts = volts_of(word) if column.role == "volts" else None
        if volts is not None:
            return signal.threshold.follow(tick, volts, row.line) if signal.threshold else ""
        return cast("str | None", self._read_cell(row, column, partial(_state_in, column.role)))

    def _add(
        self, row: Row, signal: Signal, event: TimerEvent, number: int, *, is_whole: bool
    ) -> bool:
        """Add an event; return whether it is one, and no state as it was."""
        clock, label, threshold = signal.clock, event.label, signal.threshold
        key: tuple[object, ...] = (number, signal.run)
        if self._row_is_run and clock:
            key = (number, row.line)
            label = label or (clock.name if clock.numbered and clock.name[:1] in "tTZ" else "")
        elif clock and not label and not signal.run:
            key = (number, clock.at)
        part = FilePart(signal.run, number or number_of(signal.run) or 0)
        part = self.parts.setdefault(key, part)
        last = self._last.get((key, label))
        begins = not part.events and event.state == "clear" and not event.tick and not self._is_own
        # Where each row has the states of all inputs, most of them are as they were.
        if begins or (is_whole and event.state == (last.state if last else "clear")):
            return False
        if threshold:
            event = event._replace(tick=threshold.tick, line=threshold.line)
        event = event._replace(label=label)
        if self.is_sampled or self._is_in_time(row, signal, event, part, last or event):
            self._last[key, label] = event
            part.events.append(event)
            self._events += 1
        return True

    def _is_in_time(
        self, row: Row, signal: Signal, event: TimerEvent, part: FilePart, last: TimerEvent
    ) -> bool:
        """Whether a time can be of its run; within a numbered one, those of an input go on."""
        column = cast("TimerColumn", signal.clock)
        code, values = "", dict[str, object]()
        lasting_s = abs(event.tick - part.events[0].tick) / TICK_HZ if part.events else 0.0
        limit_s, recording = _DAY_S, "the recording"
        if self._is_own:
            limit_s, recording = _HOUR_S, f"run {part.number}"
        if column.power is not None and lasting_s > limit_s:
            code = "too_long"
            values = {"recording": recording, "lasting_s": lasting_s, "limit_s": limit_s}
        elif event.tick < last.tick and self.has_runs and not self._row_is_run:
            code = "before_last"
            values = {"last": seconds(last.tick, Fraction(TICK_HZ)), "text": row.cell(column.at)}
            values |= {"channel": event.label, "run": part.number}
        if code:
            key = column.name if self._is_own else column.role
            self._problems.add(row.line, row.column(column.at), key, code, **values)
        return not code


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
