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
from rig.timers.moments import TICK_HZ, moment
from rig.timers.vocabulary import is_number, number_of, state_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rig.reasons import Reason
    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row, TimeBase

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
LONGEST_S = 86400
"""How long a recording may be: more means a wrong unit."""
_REGULAR = 1.5
"""Longest over usual step below which samples are all as far apart."""
_SHOWN = 4096
"""Rows that show it."""


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
    problems
        Its faults.
    way, ways
        In which way, from 0, its columns are understood, and how many there are.
    kind
        In words.
    columns
        What each column was taken for, by its heading.
    parts
        Events of each run, or of each gate where these stand one below the other.
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
    rows
        How many lines of data there are.
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
    period_s: float | None = None
    has_unit: bool = True
    is_counted: bool = False
    is_sampled: bool = False
    is_wide: bool = False
    rows: int = 0
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {event.label for part in self.parts for event in part.events} - {""}
        return tuple(sorted(labels, key=lambda label: (number_of(label) or 0, label)))


class EventReader:
    """Adds the events of a block to its file.

    Parameters
    ----------
    title
        Of the block: the name of its parts.
    base
        Of samples without times: when the first was taken, and the time between them, s.

    Attributes
    ----------
    is_stacked
        Whether runs, or gates, may stand one below the other; they part where times begin anew.
    """

    def __init__(
        self, file: TimerFile, columns: Sequence[TimerColumn], title: str, base: TimeBase
    ) -> None:
        self.file, self.base, self.signals = file, base, find_signals(columns)
        self.clocks = list(dict.fromkeys(signal.clock for signal in self.signals))
        self.values = [signal.value for signal in self.signals if signal.value]
        places = {column.role: column.at for column in reversed(columns)}
        self.is_sampled, self.is_analog = bool(places.keys() & set(SAMPLED)), "volts" in places
        places = {} if self.is_sampled else places
        self.run_at, self.gate_at = (places.get(role, sys.maxsize) for role in ("run", "gate"))
        self.has_several = len(self.signals) > 1 and len(self.values) > 0
        runs = [clock.run for clock in self.clocks]
        self.is_single = len(set(runs)) == len(runs)
        file.is_sampled |= self.is_sampled
        file.is_wide |= not self.is_sampled and len(runs) > 1 and not any(runs)
        self.title = "" if file.is_sampled else title
        self.is_stacked = not (file.is_sampled or file.is_wide or "run" in places)
        self.parts: dict[tuple[str, int], tuple[FilePart, dict[str, int]]] = {}
        self.starts: dict[str, int] = {}
        self.states: dict[tuple[str, str], str] = {}
        self.origin, self.ticks, self.samples, self.count = 0, array("d"), array("d"), 0

    def read(self, rows: Iterable[Row]) -> None:
        """Read rows; each gives events, or says that nothing changes, or is unread."""
        before: list[str] = []
        for count, row in enumerate(rows):
            self.file.rows += 1
            times = dict(self._times(row, count))
            if self.is_sampled and self.clocks[0] in times:
                self._note_time(row, times[self.clocks[0]])
            if self.is_analog:
                self._add_volts(row, times)
                continue
            words = [row.cell(value.at) for value in self.values]
            # Most samples are as those before.
            if words != before or not (self.is_sampled and times):
                self._add_states(row, times)
            before = words
        steps = np.diff(self.ticks[:_SHOWN])
        if steps.size:
            usual = float(np.median(steps))
            self.file.period_s = usual / TICK_HZ if steps.max() < _REGULAR * usual else None
        if self.is_analog:
            self._add_crossings()

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
                start, step = self.base
                is_count = clock.role != "time"
                yield clock, round(start * TICK_HZ + step * tick) if is_count else tick

    def _note_time(self, row: Row, tick: int) -> None:
        """Note when samples were taken, one after the other."""
        self.origin = self.origin if self.ticks else tick
        if self.ticks and tick - self.origin < self.ticks[-1]:
            at = self.clocks[0].at
            self.file.problems.add(*row.place(at), "time", "backwards", text=row.cell(at))
        self.ticks.append(tick - self.origin)

    def _add_volts(self, row: Row, times: Mapping[TimerColumn, int]) -> None:
        """Keep what a row of samples says, NaN where it says nothing."""
        try:
            volts: list[Any] = [float(row.texts[value.at]) for value in self.values]
        except (IndexError, ValueError):
            volts = [read_value("volts", row.cell(value.at)) for value in self.values]
        if None in volts:
            self._reject(row, self.values[volts.index(None)])
            return
        self.file.unread += [] if times else [row.line]
        ticks = [times[c] - self.origin if c in times else math.nan for c in self.clocks]
        self.samples.extend([*ticks, *volts, row.line])

    def _add_states(self, row: Row, times: Mapping[TimerColumn, int]) -> None:
        """Add an event for each state that begins with a row and was not there before."""
        words = ((s, row.cell(s.value.at) if s.value else "") for s in self.signals)
        cells = [
            (signal, word)
            for signal, word in words
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
            is_same = state == self.states.get(key, usual)
            is_first = key not in self.states
            self.states[key] = state
            if not is_same or not (is_whole or is_first or self.is_sampled):
                at = 0 if self.is_single or any(key) else clock.at
                self._add(key[0], at, TimerEvent(tick, key[1], state, row.line))
                lasting_s = abs(tick - self.starts.setdefault(key[0], tick)) / TICK_HZ
                if clock.power is not None and lasting_s > LONGEST_S:
                    place = *row.place(clock.at), clock.role
                    values = {"lasting_s": lasting_s, "limit_s": LONGEST_S}
                    self.file.problems.add(*place, "too_long", recording="the recording", **values)

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
                self._add(signal.run, 0, TimerEvent(self.origin + round(time), name, state, line))
            counts = {"crossings": len(crossings), "level": threshold[0]}
            self.file.notes.append(make_reason("crossings", input=name, **counts))

    def _add(self, run: str, at: int, event: TimerEvent) -> None:
        """Add an event of a run, or of a column of times, to its part."""
        part, last = self.parts.get((run, at), (None, {}))
        # Where each row has a single time, one before any above it begins anew.
        latest = max(last.values(), default=0) if self.is_single else last.get(event.label, 0)
        is_anew = self.is_stacked and event.label in last and event.tick < latest
        if part is None or is_anew:
            part, last = FilePart(run or self.title, run, []), {}
            self.parts[run, at] = part, last
            self.file.parts.append(part)
        last[event.label] = event.tick
        part.events.append(event)
        self.count += 1
        if self.count > MAX_EVENTS:
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
