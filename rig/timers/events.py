"""Rows as events: when, at which input, and what the beam or signal did.

A signal is a column of times with a column of states, levels or volts, or with none. Each of its
values is a state; events are where it changes, of volts where they cross the middle.
"""

from __future__ import annotations

import math
import sys
from array import array
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rig.reasons import make_reason
from rig.timers.columns import SAMPLED, find_signals, roles
from rig.timers.crossings import find_crossings, find_threshold
from rig.timers.moments import LONGEST_S, TICK_HZ, moment
from rig.timers.vocabulary import is_number, number_of, state_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rig.reasons import Reason
    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row, TimeBase

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""


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


class FilePart(NamedTuple):
    """Events that stand together: those of a run.

    Attributes
    ----------
    run
        The run, where the file says it.
    latest
        Time of the last one of each input, ps.
    """

    run: str
    events: list[TimerEvent]
    latest: dict[str, int]


@dataclass(slots=True)
class TimerFile:
    """What was understood of a file.

    Attributes
    ----------
    problems
        Its faults.
    way, ways
        In which way, from 0, its columns are understood, and how many there are.
    kind
        In words.
    columns
        What each column was taken for, by its heading.
    parts
        Events of each run.
    open_parts
        Those that the next row may continue, by their run and their column of times.
    period_s
        Of samples that are all as far apart, so that a row may have several changes: no edge is
        known better than that; `None` for others.
    has_unit, is_counted
        Whether the file says the unit of its times, and whether they are counts of an unknown one;
        without either they are read as seconds.
    is_sampled
        Whether it has samples: a level that changes may be of an input that is no gate.
    is_wide
        Whether a row has several times, so that it may be a run.
    begins_late
        Whether its first row is taken for a change; loggers write the state at the beginning.
    rows, events
        How many lines of data there are, and how many events they gave.
    unread
        Those that neither change anything nor say that nothing changes.
    notes
        What is to be said, a reason each.
    """

    problems: ProblemList
    way: int = 0
    ways: int = 1
    kind: str = ""
    columns: dict[str, str] = field(default_factory=dict)
    parts: list[FilePart] = field(default_factory=list)
    open_parts: dict[tuple[str, int], FilePart] = field(default_factory=dict)
    period_s: float | None = None
    has_unit: bool = True
    is_counted: bool = False
    is_sampled: bool = False
    is_wide: bool = False
    begins_late: bool = False
    rows: int = 0
    events: int = 0
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {event.label for part in self.parts for event in part.events} - {""}
        return tuple(sorted(labels, key=lambda label: (number_of(label) or 0, label)))


class EventReader:
    """Adds the events of blocks whose columns are the same to their file.

    Attributes
    ----------
    is_stacked
        Whether runs may stand one below the other; they part where times begin anew.
    """

    def __init__(self, file: TimerFile, columns: Sequence[TimerColumn]) -> None:
        self.file, self.signals = file, find_signals(columns)
        self.clocks = list(dict.fromkeys(signal.clock for signal in self.signals))
        self.values = [signal.value for signal in self.signals if signal.value]
        self.places = [s.value.at if s.value else sys.maxsize for s in self.signals]
        places = {column.role: column.at for column in reversed(columns)}
        self.roles = frozenset(places)
        self.unused = ", ".join(c.name for c in columns if c.role in {"other", "duration"})
        self.is_sampled, self.is_analog = bool(places.keys() & set(SAMPLED)), "volts" in places
        places = {} if self.is_sampled else places
        self.run_at, self.gate_at = (places.get(role, sys.maxsize) for role in ("run", "gate"))
        self.has_several = len(self.values) > 1
        runs = [clock.run for clock in self.clocks]
        self.is_single = len(set(runs)) == len(runs)
        file.is_sampled |= self.is_sampled
        file.is_wide |= not self.is_sampled and len(runs) > 1 and not any(runs)
        self.is_stacked = not (file.is_sampled or file.is_wide or "run" in places)
        self.states: dict[tuple[str, str], str] = {}
        self.firsts: dict[tuple[str, str], TimerEvent] = {}

    def read(self, rows: Iterable[Row], base: TimeBase, *, is_gate: bool) -> None:
        """Read a block; each row gives events, or says that nothing changes, or is unread.

        Parameters
        ----------
        base
            Of samples without times: when the first was taken, and the time between them, s.
        is_gate
            Whether it is of a gate that stands above it, in the run of the block before.
        """
        self.base, self.samples = base, array("d")
        self.latest, self.starts = dict[int, int](), dict[int, int]()
        silent, count, before = 0, 0, list[str]()
        if not is_gate and self.run_at == sys.maxsize:  # rows that do not say their run
            self.file.open_parts, self.states, self.firsts = {}, {}, {}
        for count, row in enumerate(rows, 1):
            times = dict(self._times(row, count - 1))
            if self.is_analog:
                self._add_volts(row, times)
                continue
            words = [row.cell(at) for at in self.places]
            silent += words == before
            # Most samples are as those before.
            if words != before or not (self.is_sampled and times):
                self._add_states(row, times, words)
            before = words
        self.file.rows += count
        if self.is_analog:
            self._add_crossings()
        elif self.is_sampled and silent < 2:  # a log of changes, its last row perhaps none
            self._add_first()
        if self.is_analog or (self.is_sampled and 2 * silent > count):
            at = self.clocks[0].at
            lasting = self.latest.get(at, 0) - self.starts.get(at, 0)
            self.file.period_s = lasting / TICK_HZ / max(1, count - 1)

    def _times(self, row: Row, count: int) -> Iterator[tuple[TimerColumn, int]]:
        """Yield the times that a row says, ps, each with its column."""
        for clock in self.clocks:
            text = row.cell(clock.at) if clock.at >= 0 else "-"
            tick = moment(text, clock.power or 0) if clock.at >= 0 else count * TICK_HZ
            # Of another input's row nothing is said; telephones fill up with zeros.
            is_filler = tick == 0 and clock.numbered and clock is not self.clocks[0]
            if text and tick is None:
                self._reject(row, clock)
            elif tick is not None and not is_filler:
                if clock.role != "time":
                    tick = round(self.base[0] * TICK_HZ + self.base[1] * tick)
                latest = self.latest.get(clock.at, tick)
                if clock.wrap:
                    tick += clock.wrap * max(0, round((latest - tick) / clock.wrap))
                lasting_s = abs(tick - self.starts.setdefault(clock.at, tick)) / TICK_HZ
                if self.is_sampled and tick < latest:
                    self.file.problems.add(*row.place(clock.at), "time", "backwards", text=text)
                if clock.power is not None and lasting_s > LONGEST_S:
                    place = row.place(clock.at)
                    limit = {"recording": "a block", "lasting_s": lasting_s, "limit_s": LONGEST_S}
                    self.file.problems.add(*place, clock.role, "too_long", **limit)
                self.latest[clock.at] = tick
                yield clock, tick

    def _add_volts(self, row: Row, times: Mapping[TimerColumn, int]) -> None:
        """Keep what a row of samples says, NaN where it says nothing."""
        volts: list[Any] = [read_value("volts", row.cell(value.at)) for value in self.values]
        if None in volts:
            self._reject(row, self.values[volts.index(None)])
            return
        self.file.unread += [] if times else [row.line]
        if not self.samples:
            self.origin = min(times.values(), default=0)
        ticks = [times[c] - self.origin if c in times else math.nan for c in self.clocks]
        self.samples.extend([*ticks, *volts, row.line])

    def _add_states(self, row: Row, times: Mapping[TimerColumn, int], words: list[str]) -> None:
        """Add an event for each state that begins with a row and was not there before."""
        cells = [
            (signal, word)
            for signal, word in zip(self.signals, words, strict=True)
            if signal.clock in times and (word or not (signal.value and self.has_several))
        ]
        self.file.unread += [] if cells else [row.line]
        # Where each row has the states of all inputs, most of them are as they were.
        is_whole = self.has_several and len(cells) == len(self.signals)
        for signal, word in cells:
            clock, tick = signal.clock, times[signal.clock]
            state = read_value(signal.value.role, word) if signal.value else clock.state
            if state is None:
                self._reject(row, signal.value or clock)
            if not isinstance(state, str):
                continue
            key = row.cell(self.run_at) or signal.run, row.cell(self.gate_at) or signal.label
            usual = state if self.is_sampled else "clear" if is_whole or not tick else None
            is_same, is_first = state == self.states.get(key, usual), key not in self.states
            event = TimerEvent(tick, key[1], state, row.line)
            self.firsts.setdefault(key, event)
            self.states[key] = state
            if not is_same or not (is_whole or is_first or self.is_sampled):
                at = 0 if self.is_single or clock.numbered or any(key) else clock.at
                self._add(key[0], event, at)

    def _add_first(self) -> None:
        """Add the first change of each input of a log of changes, if its first state is one.

        An input that is not in the end what it was at first changed then, or began dark. Inputs
        that the log names later than others changed; of the first row either may hold.
        """
        begin = min((event.line for event in self.firsts.values()), default=0)
        odd = [(run, e) for (run, x), e in self.firsts.items() if e.state != self.states[run, x]]
        for run, event in odd:
            if event.line > begin:
                self._add(run, event)
        open_firsts = [(run, event) for run, event in odd if event.line == begin]
        for run, event in open_firsts if len(open_firsts) == 1 else ():
            self.file.ways, self.file.begins_late = 2, self.file.way == 1
            if self.file.begins_late:
                self._add(run, event)
            code = "first_row" if self.file.begins_late else "first_unknown"
            self.file.notes.append(make_reason(code, input=event.label))

    def _add_crossings(self) -> None:
        """Add the events of volts; note how many they are, or that nothing passes."""
        data = np.array(self.samples).reshape(-1, len(self.clocks) + len(self.values) + 1).T
        for signal, trace in zip(self.signals, data[len(self.clocks) :], strict=False):
            times, lines, name = data[self.clocks.index(signal.clock)], data[-1], signal.label
            at = np.flatnonzero(np.isfinite(times) & np.isfinite(trace))
            threshold = find_threshold(trace[at]) if at.size else None
            if threshold is None:
                low, high = min(trace[at], default=math.nan), max(trace[at], default=math.nan)
                self.file.notes.append(make_reason("no_passage", input=name, low=low, high=high))
                continue
            crossings = list(find_crossings(times[at], trace[at], threshold))
            for n, time, is_high in crossings:
                state, line = "high" if is_high else "low", int(lines[at[n]])
                self._add(signal.run, TimerEvent(self.origin + round(time), name, state, line))
            counts = {"crossings": len(crossings), "level": threshold[0]}
            self.file.notes.append(make_reason("crossings", input=name, **counts))

    def _add(self, run: str, event: TimerEvent, at: int = 0) -> None:
        """Add an event of a run, or of a column of times, to its part."""
        part = self.file.open_parts.get((run, at))
        # Where each row has a single time, one before any above it begins anew.
        latest = part.latest if part else {}
        since = max(latest.values(), default=0) if self.is_single else latest.get(event.label, 0)
        if not part or (self.is_stacked and event.label in latest and event.tick < since):
            part = self.file.open_parts[run, at] = FilePart(run, [], {})
            self.file.parts.append(part)
        part.latest[event.label] = event.tick
        part.events.append(event)
        self.file.events += 1
        if self.file.events > MAX_EVENTS:
            self.file.problems.refuse(event.line, 1, "too_many_events", limit=MAX_EVENTS)

    def _reject(self, row: Row, column: TimerColumn) -> None:
        """Note a cell whose value is not accepted."""
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        accepted = roles()[column.role][1]
        self.file.problems.reject(*row.place(column.at), column.role, text, accepted)


@lru_cache(10_000)
def read_value(role: str, word: str) -> str | float | None:
    """Return what a word means in a column of that role; `None` if it is no value there.

    Returns
    -------
    str, float or None
        A state, or volts; no number where a sample is unknown.
    """
    if role == "volts" and is_number(word):
        return float(word)
    state, accepted = state_of(word), roles()[role][-1].split()
    if role in SAMPLED and state in {"unknown", "missing"}:
        return math.nan
    state = dict(zip(("zero", "one"), accepted, strict=False)).get(state, state)
    return state if state in accepted else None
