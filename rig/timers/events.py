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
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.reasons import make_reason
from rig.timers.columns import SAMPLED, find_signals, roles
from rig.timers.crossings import find_crossings, find_threshold
from rig.timers.moments import TICK_HZ, moment
from rig.timers.vocabulary import is_number, number_of, state_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rig.arrays import Array
    from rig.reasons import Reason
    from rig.timers.columns import Signal, TimerColumn
    from rig.timers.preamble import Row, TimeBase
    from rig.timers.problems import ProblemList

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
        places = {column.role: column.at for column in reversed(columns)}
        self.is_sampled = bool(places.keys() & set(SAMPLED))
        places = {} if self.is_sampled else places
        self.run_at, self.gate_at = (places.get(role, sys.maxsize) for role in ("run", "gate"))
        self.has_several = len(self.signals) > 1 and any(signal.value for signal in self.signals)
        runs = [clock.run for clock in {signal.clock for signal in self.signals}]
        self.is_single = len(set(runs)) == len(runs)
        file.is_sampled |= self.is_sampled
        file.is_wide |= not self.is_sampled and len(runs) > 1 and not any(runs)
        self.title = "" if file.is_sampled else title
        self.is_stacked = not (file.is_sampled or file.is_wide or "run" in places)
        self.parts: dict[tuple[str, int], tuple[FilePart, dict[str, int]]] = {}
        self.starts: dict[str, int] = {}
        self.states: dict[tuple[str, str], str] = {}
        self.traces = {signal: array("d") for signal in self.signals}
        self.origin, self.ticks, self.count = 0, array("d"), 0

    def read(self, rows: Iterable[Row]) -> None:
        """Read rows; each gives events, or says that nothing changes, or is unread."""
        file = self.file
        for count, row in enumerate(rows):
            file.rows += 1
            cells = self._cells(row, count)
            file.unread += [] if cells else [row.line]
            # Where each row has the states of all inputs, most of them are as they were.
            is_whole = self.has_several and len(cells) == len(self.signals)
            for signal, tick, value in cells:
                if tick is None or value is None:
                    self._reject(row, signal.clock if tick is None else signal.value)
                    break
                if self.is_sampled and signal is self.signals[0]:
                    self._note_time(row, signal.clock, tick)
                if isinstance(value, str):
                    self._add_state(row, signal, tick, value, is_whole=is_whole)
                else:
                    self.traces[signal].extend((tick - self.origin, value, row.line))
        steps = np.diff(self.ticks[:_SHOWN])
        if steps.size:
            usual = float(np.median(steps))
            file.period_s = usual / TICK_HZ if steps.max() < _REGULAR * usual else None
        file.notes += [
            self._add_crossings(signal, np.array(trace).reshape(-1, 3).T)
            for signal, trace in self.traces.items()
            if signal.value and signal.value.role == "volts"
        ]

    def _cells(self, row: Row, count: int) -> list[tuple[Signal, int | None, str | float | None]]:
        """Return what a row says of each input: a time and a value, `None` if not accepted."""
        cells = []
        for signal in self.signals:
            clock, value = signal.clock, signal.value
            text = row.cell(clock.at) if clock.at >= 0 else str(count)
            word = row.cell(value.at) if value else ""
            # Of another input's row nothing is said; telephones fill up with zeros.
            is_filler = clock.numbered and signal is not self.signals[0] and not moment(text)
            is_said = word or self.is_sampled or not (value and self.has_several)
            if text and is_said and not is_filler:
                tick = moment(text, clock.power or 0)
                if clock.role != "time" and tick is not None:
                    tick = round(self.base[0] * TICK_HZ + self.base[1] * tick)
                cells.append((signal, tick, read_value(value.role, word) if value else clock.state))
        return cells

    def _note_time(self, row: Row, clock: TimerColumn, tick: int) -> None:
        """Note when samples were taken, one after the other."""
        self.origin = self.origin if self.ticks else tick
        if self.ticks and tick - self.origin < self.ticks[-1]:
            text = row.cell(clock.at)
            self.file.problems.add(*row.place(clock.at), "time", "backwards", text=text)
        self.ticks.append(tick - self.origin)

    def _add_state(
        self, row: Row, signal: Signal, tick: int, state: str, *, is_whole: bool
    ) -> None:
        """Add an event where a state begins that was not there before."""
        run, label = row.cell(self.run_at) or signal.run, row.cell(self.gate_at) or signal.label
        is_first = (run, label) not in self.states
        usual = state if self.is_sampled else "clear" if is_whole or not tick else None
        is_same = state == self.states.get((run, label), usual)
        self.states[run, label] = state
        if not is_same or not (is_whole or is_first or self.is_sampled):
            at = 0 if self.is_single or run or label else signal.clock.at
            self._add(run, at, TimerEvent(tick, label, state, row.line))
            lasting_s = abs(tick - self.starts.setdefault(run, tick)) / TICK_HZ
            if signal.clock.power is not None and lasting_s > LONGEST_S:
                place = *row.place(signal.clock.at), signal.clock.role
                values = {"lasting_s": lasting_s, "limit_s": LONGEST_S}
                self.file.problems.add(*place, "too_long", recording="the recording", **values)

    def _add_crossings(self, signal: Signal, trace: Array) -> Reason:
        """Add the events of volts; return how many they are, or that nothing passes."""
        times, volts, lines = trace[:, np.isfinite(trace[1])]
        threshold = find_threshold(volts) if volts.size else None
        if threshold is None:
            span = {"low": min(volts, default=math.nan), "high": max(volts, default=math.nan)}
            return make_reason("no_passage", input=signal.label, **span)
        crossings = list(find_crossings(times, volts, threshold))
        for n, time, is_high in crossings:
            tick, state = self.origin + round(time), "high" if is_high else "low"
            self._add(signal.run, 0, TimerEvent(tick, signal.label, state, int(lines[n])))
        counts = {"crossings": len(crossings), "level": threshold[0]}
        return make_reason("crossings", input=signal.label, **counts)

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

    def _reject(self, row: Row, column: TimerColumn | None) -> None:
        """Note a cell whose value is not accepted."""
        assert column is not None
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
