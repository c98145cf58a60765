"""A table's columns as signals: numbers against time, and the events at which they change.

A column of volts, of levels or of states, and a column of times alone, are all the same thing: at a
time, an input had a value. Rows are read into signals, and only then are events looked for.
"""

from __future__ import annotations

import itertools
import math
from array import array
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.reasons import make_reason
from rig.timers.columns import SAMPLED, pair_columns, roles
from rig.timers.crossings import find_crossings, find_threshold
from rig.timers.events import TimerEvent
from rig.timers.moments import LONGEST_S, TICK_HZ, moment
from rig.timers.vocabulary import is_number, state_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rig.timers.columns import ColumnPair, TimerColumn
    from rig.timers.events import TimerFile
    from rig.timers.table import Row, TimeBase


STATES = ("low", "high", "clear", "blocked")
"""What may begin with an event: of the signal, or of the beam."""
MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""


Sample = tuple[float, float, float]
"""Its line, its time since the first of its column, ps, and its value."""


class Signal(NamedTuple):
    """What an input of a run was at each time.

    Attributes
    ----------
    pair
        The columns that it is read from.
    run, label
        What the file calls the run and the input; empty where it does not say.
    samples
        Of each its line, its time since the first of its column, ps, and volts, or which state of
        those that its column may have; no number where that is not known.
    """

    pair: ColumnPair
    run: str
    label: str
    samples: array[float]

    def state(self, value: float) -> str:
        """Return what a value means; nothing where the file does not say."""
        return "" if math.isnan(value) else STATES[int(value)]

    def known(self) -> list[Sample]:
        """Return the samples whose values are known, or are not said at all."""
        samples = zip(*[iter(self.samples)] * 3, strict=True)
        is_sampled = self.pair.value.role in SAMPLED
        return [sample for sample in samples if not (is_sampled and math.isnan(sample[2]))]


class SignalReader:
    """Reads blocks whose columns are the same.

    Attributes
    ----------
    is_stacked
        Whether runs may stand one below the other; they part where times begin anew.
    """

    def __init__(self, file: TimerFile, columns: Sequence[TimerColumn]) -> None:
        self.file, self.pairs = file, pair_columns(columns)
        self.clocks = list(dict.fromkeys(pair.clock for pair in self.pairs))
        self.places = {column.role: column.at for column in reversed(columns)}
        self.unused = ", ".join(c.name for c in columns if c.role in {"other", "duration"})
        self.is_sampled = not self.places.keys().isdisjoint(SAMPLED)
        self.has_several = sum(pair.value.role != "moment" for pair in self.pairs) > 1
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
        self.signals = dict[tuple[int, str, str], Signal]()
        silent, count, before = 0, 0, list[str]()
        for count, row in enumerate(rows, 1):
            ticks = dict(self._read_times(row, count - 1))
            words = [row.cell(pair.value.at) or pair.value.state for pair in self.pairs]
            silent += words == before
            # Most levels are as those before.
            if words != before or not ticks or "level" not in self.places:
                self._add_values(row, ticks, words)
            before = words
        self.file.rows += count
        if self.is_sampled and ("volts" in self.places or 2 * silent > count):
            at = self.clocks[0].at
            lasting = self.latest.get(at, 0) - self.starts.get(at, 0)
            self.file.period = lasting * 10 ** self.clocks[0].assumed // max(1, count - 1)
        filled = sum(len(signal.samples) for signal in self.signals.values()) // 3
        is_whole = self.has_several and 2 * filled >= (len(self.signals) + 1) * count
        changes = [
            (signal, change)
            for signal in self.signals.values()
            for change in self._find_changes(signal, is_each=not (is_whole or self.is_sampled))
        ]
        if "level" in self.places and silent < 2:
            changes += self._find_firsts()
        for signal, change in sorted(changes, key=lambda pair: pair[1][0]):
            self._add_event(signal, *change)

    def _read_times(self, row: Row, count: int) -> Iterator[tuple[int, int]]:
        """Yield the times that a row says, ps, each with its column."""
        for clock in self.clocks:
            at = clock.at
            text = row.cell(at) if at >= 0 else str(count)
            tick = moment(text, clock.assumed if clock.power is None else clock.power)
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
            self.latest[at] = tick
            yield at, tick

    def _add_values(self, row: Row, ticks: Mapping[int, int], words: Sequence[str]) -> None:
        """Add what a row says to the signals; where several inputs have cells, some are empty."""
        is_read = False
        for n, (pair, word) in enumerate(zip(self.pairs, words, strict=True)):
            is_moment = pair.value.role == "moment"
            if pair.clock.at not in ticks or (self.has_several and not word and not is_moment):
                continue
            is_read = True
            value = read_value(pair.value.role, word)
            if value is None:
                self._reject(row, pair.value)
                continue
            key = n, row.cell(pair.run_at), row.cell(pair.gate_at)
            if (signal := self.signals.get(key)) is None:
                run, label = key[1] or pair.run, key[2] or pair.label
                signal = self.signals[key] = Signal(pair, run, label, array("d"))
            tick = ticks[pair.clock.at] - self.starts[pair.clock.at]
            signal.samples.extend((row.line, tick, value))
        self.file.unread += [] if is_read else [row.line]

    def _find_changes(self, signal: Signal, *, is_each: bool) -> list[Sample]:
        """Return the samples at which something changes, or each but the state at the beginning."""
        if signal.pair.value.role == "volts":
            return self._find_crossings(signal)
        samples = signal.known()
        changes = [b for a, b in itertools.pairwise(samples) if is_each or a[2] != b[2]]
        if signal.pair.value.role in SAMPLED:
            return changes
        is_begin = not is_each or self.starts[signal.pair.clock.at] + samples[0][1] == 0
        is_state = is_begin and signal.state(samples[0][2]) == "clear"
        return changes if is_state else samples[:1] + changes

    def _find_crossings(self, signal: Signal) -> list[Sample]:
        """Return where volts cross the middle; note how many do, or that nothing passes."""
        samples = np.array(signal.samples).reshape(-1, 3)
        samples = samples[np.isfinite(samples[:, 2])]
        volts, name = samples[:, 2], signal.label
        if (threshold := find_threshold(volts)) is None:
            low, high = min(volts, default=math.nan), max(volts, default=math.nan)
            self.file.notes.append(make_reason("no_passage", input=name, low=low, high=high))
            return []
        crossings: list[Sample] = find_crossings(samples, threshold).tolist()
        counts = {"crossings": len(crossings), "level": threshold[0]}
        self.file.notes.append(make_reason("crossings", input=name, **counts))
        return crossings

    def _find_firsts(self) -> Iterator[tuple[Signal, Sample]]:
        """Yield the first change of each input of a log of changes, if its first state is one.

        An input that is not in the end what it was at first changed then, or began dark. Inputs
        that the log names later than others changed; of those at its begin either may hold.
        """
        known = [(signal, signal.known()) for signal in self.signals.values()]
        odd = [(signal, x[0]) for signal, x in known if x and x[0][2] != x[-1][2]]
        begin = min((samples[0][0] for _, samples in known if samples), default=0)
        yield from ((signal, first) for signal, first in odd if first[0] > begin)
        unclear = [(signal, first) for signal, first in odd if first[0] == begin]
        if len(unclear) == 1:
            self.file.ways, self.file.begins_late = 2, self.file.way == 1
            yield from unclear if self.file.begins_late else ()
            code = "first_row" if self.file.begins_late else "first_unknown"
            self.file.notes.append(make_reason(code, input=unclear[0][0].label))

    def _add_event(self, signal: Signal, line: float, offset: float, value: float) -> None:
        """Add an event to the part of its run, or to a new one where times begin anew."""
        clock, events, label = signal.pair.clock, self.file.events, signal.label
        is_one = self.is_single or clock.numbered or signal.run or label
        tick = (self.starts[clock.at] + round(offset)) * 10**clock.assumed
        key = signal.run, 0 if is_one else clock.at
        part, latest = self.file.open_parts.get(key, (len(events), dict[str, int]()))
        # Where each row has a single time, one before any above it begins anew.
        since = max(latest.values(), default=0) if self.is_single else latest.get(label, 0)
        if self.is_stacked and label in latest and tick < since:
            part, latest = len(events), {}
        latest[label] = tick
        self.file.open_parts[key] = part, latest
        events.append(TimerEvent(tick, label, signal.state(value), int(line), signal.run, part))
        if len(events) > MAX_EVENTS:
            self.file.problems.refuse(int(line), 1, "too_many_events", limit=MAX_EVENTS)

    def _reject(self, row: Row, column: TimerColumn) -> None:
        """Note a cell whose value is not accepted."""
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        accepted = roles()[column.role][1]
        self.file.problems.reject(*row.place(column.at), column.role, text, accepted)


@lru_cache(10_000)
def read_value(role: str, word: str) -> float | None:
    """Return volts, or which of `STATES` a word is in such a column; `None` for another word.

    Returns
    -------
    float or None
        No number where a sample is unknown.
    """
    if role == "volts" and is_number(word):
        return float(word)
    state, pair = state_of(word), roles()[role][-1].split()
    if state in {"unknown", "missing"} and role in {*SAMPLED, "moment"}:
        return math.nan
    state = dict(zip(("zero", "one"), pair, strict=False)).get(state, state)
    return STATES.index(state) if state in pair else None
