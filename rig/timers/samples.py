"""Samples, of volts, of light or of levels, as events: where an input changes.

Volts become levels with hysteresis around the middle between dark and bright; they change where a
straight line between two samples crosses that middle.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.reasons import Reason, make_reason
from rig.timers.events import EventList, TimerEvent
from rig.timers.moments import TICK_HZ, moment
from rig.timers.vocabulary import is_number, state_of

if TYPE_CHECKING:
    from rig.arrays import Array
    from rig.timers.columns import Signal, TimerColumn
    from rig.timers.table import Row

_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""
_SCATTER = 1.4826
"""Standard deviation over the median of absolute deviations, of normal noise."""
_REGULAR = 1.5
"""Longest over usual step below which samples are all as far apart."""
_CHUNK = 4096
_LEVELS = {"zero": 0.0, "low": 0.0, "one": 1.0, "high": 1.0}


class SampleReader:
    """Reads rows of samples; of levels it keeps only those at which something changes.

    Parameters
    ----------
    base
        Of samples without times: when the first was taken, and the time between them, s.

    Attributes
    ----------
    period_s
        Of samples that are all as far apart; `None` for others.
    """

    def __init__(self, signals: Sequence[Signal], base: tuple[float, float], out: EventList):
        self.signals, self.base, self.out = signals, base, out
        self.clocks = list(dict.fromkeys(signal.clock for signal in signals))
        self.values = [v for v in dict.fromkeys(signal.value for signal in signals) if v]
        self.is_digital = all(value.role == "level" for value in self.values)
        self.origin: int | None = None
        self.period_s: float | None = None

    def read(self, rows: Iterator[Row]) -> Iterator[Reason]:
        """Add the changes of each input, and say how many volts there are."""
        columns: list[TimerColumn | None] = [*self.clocks, *self.values]
        chunks: list[Array] = []
        last, inputs = np.empty((0, 0)), slice(len(self.clocks), -1)
        while chunk := list(itertools.islice(rows, _CHUNK)):
            ticks = (self._read_ticks(chunk, clock) for clock in self.clocks)
            levels = (self._read_levels(chunk, value) for value in self.values)
            data = np.array([*ticks, *levels, [row.line for row in chunk]])
            before = last if last.size else data[:, :1]
            steps = np.diff(data[0], prepend=before[0])
            for n in np.flatnonzero(steps < 0)[:1]:
                row, at = chunk[int(n)], self.clocks[0].at
                self.out.problems.add(*row.place(at), "time", "backwards", text=row.cell(at))
            if not last.size and len(chunk) > 1:
                usual = float(np.median(steps[1:]))
                self.period_s = usual / TICK_HZ if steps.max() < _REGULAR * usual else None
            last = data[:, -1:]
            if self.is_digital:
                is_change = np.any(np.diff(data[inputs], prepend=before[inputs]) != 0, axis=0)
                is_change[0] |= not chunks
                data = data[:, is_change]
            chunks.append(data)
            self.out.rows += len(chunk)
        data = np.concatenate(chunks, axis=-1)
        for signal in self.signals:
            times, trace = (data[columns.index(column)] for column in (signal.clock, signal.value))
            yield from self._find_changes(signal, times, trace, data[-1])

    def _read_ticks(self, rows: Sequence[Row], clock: TimerColumn) -> Array:
        """Return when samples were taken, ps from the origin; NaN where a trace ends."""
        if clock.at < 0:
            ticks = [n * TICK_HZ for n in range(self.out.rows, self.out.rows + len(rows))]
        else:
            read = partial(moment, power=clock.power or 0)
            ticks = [self._read_cell(row, clock, read) for row in rows]
        if clock.role != "time":
            start, step = self.base
            ticks = [x if x is None else round(start * TICK_HZ + step * x) for x in ticks]
        if self.origin is None:
            self.origin = next((x for x in ticks if x is not None), 0)
        return np.array([x if x is None else x - self.origin for x in ticks], dtype=float)

    def _read_levels(self, rows: Sequence[Row], value: TimerColumn) -> Array:
        numbers = _numbers([row.cell(value.at) for row in rows])
        if np.isinf(numbers).any() or (self.is_digital and not np.isin(numbers, (0.0, 1.0)).all()):
            return np.array([self._read_cell(row, value, _level_of) for row in rows], float)
        return numbers

    def _read_cell(self, row: Row, column: TimerColumn, read: Callable[[str], Any]) -> Any:
        value = read(row.cell(column.at))
        # A trace may end before another.
        if value is None and (len(self.clocks) == 1 or row.cell(column.at)):
            self.out.reject(row, column)
        return value

    def _find_changes(
        self, signal: Signal, times: Array, trace: Array, lines: Array
    ) -> Iterator[Reason]:
        at = np.flatnonzero(np.isfinite(times) & np.isfinite(trace))
        # Where nothing of it can be read, its lowest and its highest are no numbers.
        volts = trace[at] if at.size else np.full(1, np.nan)
        threshold = (0.5, 0.0) if self.is_digital else find_threshold(volts)
        if threshold is None:
            span = {"low": float(volts.min()), "high": float(volts.max())}
            yield make_reason("no_passage", input=signal.label, **span)
            return
        crossings = list(_crossings(times[at], trace[at], threshold))
        for n, tick, is_high in crossings:
            ticks = round(float(times[at[n]]) if self.is_digital else tick)
            state, line = "high" if is_high else "low", int(lines[at[n]])
            event = TimerEvent((self.origin or 0) + ticks, signal.label, state, line)
            self.out.put(signal.run, 0, event)
        if not self.is_digital:
            values = {"crossings": len(crossings), "level": threshold[0]}
            yield make_reason("crossings", input=signal.label, **values)


def _numbers(texts: Sequence[str]) -> Array:
    """Return numbers; infinity, for all of them, where one is none."""
    try:
        return np.fromiter(map(float, texts), float, len(texts))
    except ValueError:
        return np.full(len(texts), np.inf)


def _level_of(text: str) -> float | None:
    """Return a level, or volts; NaN for an unknown one, `None` for another text."""
    if not text or text in "xXzZ":
        return np.nan
    return float(text) if is_number(text) else _LEVELS.get(state_of(text))


def _crossings(
    times: Array, volts: Array, threshold: tuple[float, float]
) -> Iterator[tuple[int, float, bool]]:
    """Yield the sample behind each crossing, its moment, and whether it rises."""
    is_high = volts > threshold[0]
    sure = np.flatnonzero(np.abs(volts - threshold[0]) > threshold[1])
    turns = sure[1:][is_high[sure[1:]] != is_high[sure[:-1]]]
    crossings = np.flatnonzero(is_high[1:] != is_high[:-1]) + 1
    for n in crossings[np.searchsorted(crossings, turns, side="right") - 1]:
        share = (volts[n] - threshold[0]) / (volts[n] - volts[n - 1])
        yield int(n), float(times[n] - share * (times[n] - times[n - 1])), bool(is_high[n])


def find_threshold(volts: Array) -> tuple[float, float] | None:
    """Return the middle between two levels, and half the hysteresis; `None` without two levels."""
    low, high = float(volts.min()), float(volts.max())
    for _ in range(50):  # two means, one for each level
        above = volts > 0.5 * (low + high)
        if above.all() or not above.any():
            return None
        before = low, high
        low, high = float(np.median(volts[~above])), float(np.median(volts[above]))
        if before == (low, high):
            break
    above = volts > 0.5 * (low + high)
    levels = ((above, high), (~above, low))
    noise = max(float(np.median(np.abs(volts[mask] - level))) for mask, level in levels)
    swing = high - low
    is_clear = swing >= _CLEAR_SWING * _SCATTER * noise
    return (0.5 * (low + high), 0.5 * _HYSTERESIS * swing) if is_clear else None
