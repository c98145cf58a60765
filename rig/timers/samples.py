"""Samples, of volts, of light or of levels, as events: where an input changes.

Volts become levels with hysteresis around the middle between dark and bright; they change where a
straight line between two samples crosses that middle.
"""

from __future__ import annotations

import itertools
from array import array
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rig.reasons import Reason, make_reason
from rig.timers.events import RowReader, TimerEvent
from rig.timers.moments import TICK_HZ
from rig.timers.vocabulary import is_number, state_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.arrays import Array
    from rig.timers.columns import TimerColumn
    from rig.timers.table import Row, RowBlock, Table

_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""
_SCATTER = 1.4826
"""Standard deviation over the median of absolute deviations, of normal noise."""
_EXACT = 2.0**53
_CHUNK = 4096
"""Rows that are read one by one where some cannot be read at once."""
_LEVELS = {"zero": 0.0, "low": 0.0, "one": 1.0, "high": 1.0}


class _Samples:
    """Samples as they are read: those at which nothing changes are left out of levels."""

    def __init__(self, reader: RowReader, base: tuple[float, float]) -> None:
        self.reader, self.base = reader, base
        self.clocks = list(dict.fromkeys(signal.clock for signal in reader.signals))
        self.values = [v for v in dict.fromkeys(s.value for s in reader.signals) if v]
        self.is_digital = all(value.role == "level" for value in self.values)
        self.stamps, self.levels, self.lines = array("d"), array("f"), array("L")
        self.origin: int | None = None
        self._last, self._last_texts = list[float](), list[str]()

    def add(self, row: Row) -> None:
        """Add a row of any form."""
        reader, first = self.reader, self.clocks[0]
        reader.rows += 1
        texts = [row.cell(column.at) for column in self.values]
        ticks = [self._read_tick(row, clock) for clock in self.clocks]
        self.origin = ticks[0] if self.origin is None else self.origin
        now = [np.nan if tick is None else float(tick - (self.origin or 0)) for tick in ticks]
        if first and self._last and now[0] < self._last[0]:
            place, text = row.column(first.at), row.cell(first.at)
            reader.problems.add(row.line, place, "time", "backwards", text=text)
        self._last = now
        if self.is_digital and texts == self._last_texts:
            return
        self._last_texts = texts
        try:
            self.levels.extend(list(map(float, texts)))
        except ValueError:
            cells = [reader.read_cell(row, column, _level_of, np.nan) for column in self.values]
            self.levels.extend([np.nan if level is None else level for level in cells])
        self.stamps.extend(now)
        self.lines.append(row.line)

    def add_numbers(self, lines: Sequence[int], numbers: Array) -> bool:
        """Add rows of numbers at once; false where these are to be read row by row."""
        count, width = len(lines), sum(clock is not None for clock in self.clocks)
        if self.origin is None or (
            self.is_digital and not np.isin(numbers[:, width:], (0, 1)).all()
        ):
            return False
        ticks = np.empty((count, len(self.clocks)))
        for n, clock in enumerate(self.clocks):
            is_time = clock is not None and clock.role == "time"
            start, step = (0.0, 10.0 ** -((clock and clock.power) or 0)) if is_time else self.base
            number = numbers[:, n] if clock else self.reader.rows + np.arange(count)
            ticks[:, n] = (start + step * number) * TICK_HZ - self.origin
        # Beyond that, a float is not exact to the picosecond.
        if np.abs(ticks + self.origin).max() > _EXACT or np.any(
            np.diff(ticks[:, 0], prepend=self._last[0]) < 0
        ):
            return False
        values = numbers[:, width:].astype(np.float32)
        is_kept = np.ones(count, dtype=bool)
        if self.is_digital:
            is_kept[1:] = np.any(values[1:] != values[:-1], axis=1)
        self.reader.rows += count
        self._last, self._last_texts = list(ticks[-1]), []
        self.stamps.frombytes(np.round(ticks[is_kept]).tobytes())
        self.levels.frombytes(values[is_kept].tobytes())
        self.lines.extend(np.asarray(lines)[is_kept].tolist())
        return True

    def find_changes(self) -> Iterator[Reason]:
        """Give the changes of each input to the reader, and say how many volts have."""
        times: Array = np.frombuffer(self.stamps).reshape(-1, len(self.clocks)).T
        volts = np.frombuffer(self.levels, dtype=np.float32).reshape(-1, len(self.values)).T
        by_clock = dict(zip(self.clocks, times, strict=True))
        by_value = dict(zip(self.values, volts, strict=True))
        for signal in self.reader.signals:
            at_time, label = by_clock[signal.clock], signal.label
            trace = by_value[signal.value or self.values[0]]
            at = np.flatnonzero(np.isfinite(at_time) & np.isfinite(trace))
            threshold = (0.5, 0.0) if self.is_digital else find_threshold(trace[at])
            if threshold is None:
                span = {"low": float(trace[at].min()), "high": float(trace[at].max())}
                yield make_reason("no_passage", input=label, **span)
                continue
            crossings = list(_crossings(at_time[at], trace[at], threshold))
            for n, tick, is_high in crossings:
                ticks = round(float(at_time[at[n]]) if self.is_digital else tick)
                level, line = "high" if is_high else "low", self.lines[at[n]]
                event = TimerEvent((self.origin or 0) + ticks, label, level, line)
                self.reader.put((0, signal.run), signal.run, 0, event)
            if not self.is_digital:
                values = {"crossings": len(crossings), "level": threshold[0]}
                yield make_reason("crossings", input=label, **values)

    def _read_tick(self, row: Row, clock: TimerColumn | None) -> int | None:
        """Return when a sample was taken, ps; nothing where a trace ends before another."""
        if clock and len(self.clocks) > 1 and not row.cell(clock.at):
            return None
        if clock and clock.role == "time":
            return self.reader.read_time(row, clock)
        count = (self.reader.rows - 1) * TICK_HZ
        number = self.reader.read_time(row, clock) if clock else count
        return None if number is None else round(TICK_HZ * self.base[0] + number * self.base[1])


def read_samples(
    reader: RowReader, sample: Sequence[Row], rows: Iterator[Row], table: Table, block: RowBlock
) -> list[Reason]:
    """Read rows of samples; give the changes to a reader, and say how many volts there are."""
    samples = _Samples(reader, block.base)
    further, columns = sample, [*filter(None, samples.clocks), *samples.values]
    while further:
        for row in further:
            samples.add(row)
        while numbers := table.take_numbers([column.at for column in columns]):
            if not samples.add_numbers(*numbers):
                table.put_back()
                break
        further = list(itertools.islice(rows, _CHUNK))
    return list(samples.find_changes())


def _level_of(text: str) -> float | None:
    """Return a level, or volts; NaN for an unknown one, `None` for another text."""
    if not text or text in "xXzZ":
        return np.nan
    return float(text) if is_number(text) else _LEVELS.get(state_of(text))


def _crossings(
    times: Array, volts: NDArray[np.float32], threshold: tuple[float, float]
) -> Iterator[tuple[int, float, bool]]:
    """Yield the sample behind each crossing, its moment, and whether it rises."""
    is_high = volts > threshold[0]
    sure = np.flatnonzero(np.abs(volts - threshold[0]) > threshold[1])
    turns = sure[1:][is_high[sure[1:]] != is_high[sure[:-1]]]
    crossings = np.flatnonzero(is_high[1:] != is_high[:-1]) + 1
    for n in crossings[np.searchsorted(crossings, turns, side="right") - 1]:
        share = (volts[n] - threshold[0]) / (volts[n] - volts[n - 1])
        yield int(n), float(times[n] - share * (times[n] - times[n - 1])), bool(is_high[n])


def find_threshold(volts: NDArray[np.float32]) -> tuple[float, float] | None:
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
