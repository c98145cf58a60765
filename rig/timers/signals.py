"""Rows of a table as events: what each column says at a time, and when that changes.

A column of volts, of levels or of states, and a column of times alone, are all the same thing: at a
time, an input had a value. Volts are gathered, to find their middle; others are read in one go.
"""

from __future__ import annotations

from array import array
from collections import defaultdict
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rig.reasons import make_reason
from rig.timers.columns import SAMPLED, pair_columns, roles
from rig.timers.crossings import find_crossings, find_threshold
from rig.timers.events import TimerEvent
from rig.timers.moments import LONGEST_S, TICK_HZ, moment
from rig.timers.vocabulary import is_number, state_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from rig.arrays import Array
    from rig.timers.columns import TimerColumn
    from rig.timers.events import TimerFile
    from rig.timers.table import Row, TimeBase

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""

Key = tuple[int, str, str]
"""A signal: which pair of columns, and what a row says of its run and its input."""


class SignalReader:
    """Reads blocks whose columns are the same.

    Attributes
    ----------
    is_whole
        Whether each row says the states of all inputs, so that those that change are events;
        otherwise each state is.
    is_stacked
        Whether runs may stand one below the other; they part where times begin anew.
    """

    def __init__(self, file: TimerFile, columns: list[TimerColumn], sample: list[Row]) -> None:
        self.file, self.pairs = file, pair_columns(columns)
        self.clocks = list(dict.fromkeys(pair.clock for pair in self.pairs))
        self.places = {column.role: column.at for column in reversed(columns)}
        self.unused = ", ".join(c.name for c in columns if c.role in {"other", "duration"})
        self.is_sampled = not self.places.keys().isdisjoint(SAMPLED)
        values = [pair.value.at for pair in self.pairs if pair.value.role != "moment"]
        filled = sum(row.cell(at) != "" for row in sample for at in values)
        self.has_several = len(values) > 1
        self.is_whole = self.has_several and 2 * filled >= (len(values) + 1) * len(sample)
        runs = [clock.run for clock in self.clocks]
        self.is_single = len(set(runs)) == len(runs)
        file.is_sampled |= self.is_sampled
        file.is_wide |= not self.is_sampled and len(runs) > 1 and not any(runs)
        self.has_runs = "run" in self.places and not self.is_sampled
        self.is_stacked = not (file.is_sampled or file.is_wide or self.has_runs)

    def read(self, rows: Iterable[Row], base: TimeBase, *, is_gate: bool) -> None:
        """Read a block; each row gives values, or says that nothing changes, or is unread.

        Parameters
        ----------
        base
            Of samples without times: when the first was taken, and the time between them, s.
        is_gate
            Whether it is of a gate that stands above it, in the run of the block before.
        """
        if not (is_gate or self.has_runs):  # rows that do not say their run
            self.file.open_parts = {}
        self.base, self.latest, self.starts = base, dict[int, int](), dict[int, int]()
        self.states, self.firsts = dict[Key, str](), dict[Key, tuple[int, str, int]]()
        self.volts: dict[Key, array[float]] = defaultdict(lambda: array("d"))
        silent, count, before = 0, 0, list[str]()
        for count, row in enumerate(rows, 1):
            ticks = self._read_times(row, count - 1)
            words = [row.cell(pair.value.at) or pair.value.state for pair in self.pairs]
            silent += words == before
            # Most levels are as those before.
            if words != before or not ticks or "level" not in self.places:
                self._read_values(row, ticks, words)
            before = words
        self.file.rows += count
        if self.is_sampled and ("volts" in self.places or 2 * silent > count):
            at = self.clocks[0].at
            lasting = self.latest.get(at, 0) - self.starts.get(at, 0)
            self.file.period = lasting // max(1, count - 1)
        for key, samples in self.volts.items():
            self._add_crossings(key, np.frombuffer(samples).reshape(-1, 3))
        if "level" in self.places and silent < 2:
            self._add_firsts()

    def _read_times(self, row: Row, count: int) -> dict[int, int]:
        """Return the times that a row says, ps, by their columns."""
        ticks: dict[int, int] = {}
        for clock in self.clocks:
            at = clock.at
            text = row.cell(at) if at >= 0 else str(count)
            tick = moment(text, clock.power or 0)
            if text and tick is None:
                self._reject(row, clock)
            # Of another input's row nothing is said; telephones fill up with zeros.
            if tick is None or (tick == 0 and clock.numbered and clock is not self.clocks[0]):
                continue
            if clock.role != "time":
                tick = round(self.base[0] * TICK_HZ + self.base[1] * tick)
            latest, problems = self.latest.get(at, tick), self.file.problems
            if clock.wrap:
                tick += clock.wrap * max(0, round((latest - tick) / clock.wrap))
            lasting_s = abs(tick - self.starts.setdefault(at, tick)) / TICK_HZ
            if self.is_sampled and tick < latest:
                problems.add(*row.place(at), "time", "backwards", text=text)
            if clock.power is not None and lasting_s > LONGEST_S:
                limit = {"recording": "a block", "lasting_s": lasting_s, "limit_s": LONGEST_S}
                problems.add(*row.place(at), clock.role, "too_long", **limit)
            self.latest[at] = ticks[at] = tick
        return ticks

    def _read_values(self, row: Row, ticks: Mapping[int, int], words: Sequence[str]) -> None:
        """Read what a row says; where several inputs have cells, some are empty."""
        is_read = False
        for n, (pair, word) in enumerate(zip(self.pairs, words, strict=True)):
            role, tick = pair.value.role, ticks.get(pair.clock.at)
            if tick is None or (self.has_several and not word and role != "moment"):
                continue
            is_read = True
            key = n, row.cell(pair.run_at), row.cell(pair.gate_at)
            if role == "volts" and is_number(word):
                offset = tick - self.starts[pair.clock.at]
                self.volts[key].extend((row.line, offset, float(word)))
            elif (state := read_state(role, word)) is None:
                self._reject(row, pair.value)
            elif state or not self.is_sampled:
                self._add_state(key, tick, state, row.line)
        self.file.unread += [] if is_read else [row.line]

    def _add_state(self, key: Key, tick: int, state: str, line: int) -> None:
        """Add the event that a state is, unless it is as before, or that at the beginning."""
        before, self.states[key] = self.states.get(key), state
        if before is None and self.is_sampled:
            self.firsts[key] = tick, state, line
        elif before is None:
            if state != "clear" or (tick != 0 and not self.is_whole):
                self._add_event(key, tick, state, line)
        elif state != before or not (state and (self.is_whole or self.is_sampled)):
            self._add_event(key, tick, state, line)

    def _add_crossings(self, key: Key, samples: Array) -> None:
        """Add where volts cross the middle; note how many do, or that nothing passes."""
        pair, volts = self.pairs[key[0]], samples[:, 2]
        label = key[2] or pair.label
        if (threshold := find_threshold(volts)) is None:
            limits = {"low": min(volts), "high": max(volts)}
            self.file.notes.append(make_reason("no_passage", input=label, **limits))
            return
        crossings = find_crossings(samples, threshold).tolist()
        counts = {"crossings": len(crossings), "level": threshold[0]}
        self.file.notes.append(make_reason("crossings", input=label, **counts))
        for line, offset, is_high in crossings:
            tick = self.starts[pair.clock.at] + round(offset)
            self._add_event(key, tick, "high" if is_high else "low", int(line))

    def _add_firsts(self) -> None:
        """Add the first change of each input of a log of changes, if its first state is one.

        An input that is not in the end what it was at first changed then, or began dark. Inputs
        that the log names later than others changed; of those at its begin either may hold.
        """
        odd = {key: first for key, first in self.firsts.items() if first[1] != self.states[key]}
        begin = min((line for _, _, line in self.firsts.values()), default=0)
        unclear = [key for key, (_, _, line) in odd.items() if line == begin]
        for key in odd.keys() - set(unclear):
            self._add_event(key, *odd[key])
        if len(unclear) == 1:
            self.file.first = self._event(unclear[0], *odd[unclear[0]])

    def _add_event(self, key: Key, tick: int, state: str, line: int) -> None:
        self.file.events.append(self._event(key, tick, state, line))
        if len(self.file.events) > MAX_EVENTS:
            self.file.problems.refuse(line, 1, "too_many_events", limit=MAX_EVENTS)

    def _event(self, key: Key, tick: int, state: str, line: int) -> TimerEvent:
        """Make an event of the part of its run, or of a new one where times begin anew."""
        pair, parts, count = self.pairs[key[0]], self.file.open_parts, len(self.file.events)
        run, label = key[1] or pair.run, key[2] or pair.label
        is_one = self.is_single or pair.clock.numbered or run or label
        place = run, 0 if is_one else pair.clock.at
        part, latest, newest = parts.get(place, (count, dict[str, int](), tick))
        # Where each row has a single time, one before any above it begins anew.
        since = newest if self.is_single else latest.get(label, tick)
        if self.is_stacked and label in latest and tick < since:
            part, latest, newest = count, {}, tick
        latest[label] = tick
        parts[place] = part, latest, max(newest, tick)
        return TimerEvent(tick, label, state, line, run, part)

    def _reject(self, row: Row, column: TimerColumn) -> None:
        """Note a cell whose value is not accepted."""
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        accepted = roles()[column.role][1]
        self.file.problems.reject(*row.place(column.at), column.role, text, accepted)


@lru_cache(10_000)
def read_state(role: str, word: str) -> str | None:
    """Return what a word means in such a column: nothing where that is not known or not said.

    Returns
    -------
    str or None
        ``low`` or ``high`` of the signal, ``clear`` or ``blocked`` of the beam; `None` for another
        word.
    """
    state, pair = state_of(word), roles()[role][-1].split()
    if state in {"unknown", "missing"} and role in {*SAMPLED, "moment"}:
        return ""
    state = dict(zip(("zero", "one"), pair, strict=False)).get(state, state)
    return state if state in pair else None
