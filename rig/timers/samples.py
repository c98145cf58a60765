"""Samples, of volts, of light or of levels, as events: where an input changes.

Volts become levels with hysteresis around the middle between dark and bright; they change where a
straight line between two samples crosses that middle.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.reasons import Reason, make_reason
from rig.timers.events import RowReader, TimerEvent
from rig.timers.moments import TICK_HZ
from rig.timers.vocabulary import is_number, state_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.arrays import Array
    from rig.timers.columns import TimerColumn
    from rig.timers.table import Row

_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""
_SCATTER = 1.4826
"""Standard deviation over the median of absolute deviations, of normal noise."""
_LEVELS = {"zero": 0.0, "low": 0.0, "one": 1.0, "high": 1.0}


class Threshold(NamedTuple):
    """The middle between two levels, and half the hysteresis."""

    centre: float
    half: float


def read_samples(reader: RowReader, rows: Iterable[Row], base: tuple[float, float]) -> list[Reason]:
    """Read rows of samples; give the changes to a reader, and say how many volts there are.

    Parameters
    ----------
    base
        Of samples without times: when the first was taken, and the time between them, s.
    """
    clocks = list(dict.fromkeys(signal.clock for signal in reader.signals))
    values = list(dict.fromkeys(signal.value for signal in reader.signals))
    stamps, levels, lines, origin = array("d"), array("f"), array("L"), 0
    last, last_texts, is_digital = (
        list[float](),
        list[str](),
        all(c and c.role == "level" for c in values),
    )
    for reader.rows, row in enumerate(rows, 1):
        texts = [row.cell(column.at) for column in values if column]
        is_over = [len(clocks) > 1 and clock and not row.cell(clock.at) for clock in clocks]
        ticks = [
            None if over else _read_tick(reader, row, clock, base)
            for clock, over in zip(clocks, is_over, strict=True)
        ]
        origin = origin if stamps else int(ticks[0] or 0)
        now = [np.nan if tick is None else float(tick - origin) for tick in ticks]
        if clocks[0] and last and now[0] < last[0]:
            place, text = row.column(clocks[0].at), row.cell(clocks[0].at)
            reader.problems.add(row.line, place, "time", "backwards", text=text)
        last = now
        if is_digital and texts == last_texts:
            continue  # most samples of an input that changes now and then
        last_texts = texts
        try:
            levels.extend(list(map(float, texts)))
        except ValueError:
            cells = [reader.read_cell(row, column, _level_of, np.nan) for column in values]
            levels.extend([np.nan if level is None else level for level in cells])
        stamps.extend(now)
        lines.append(row.line)
    times: Array = np.frombuffer(stamps).reshape(-1, len(clocks)).T
    volts = np.frombuffer(levels, dtype=np.float32).reshape(-1, len(values)).T
    by_clock, by_value = (
        dict(zip(clocks, times, strict=True)),
        dict(zip(values, volts, strict=True)),
    )
    notes = list[Reason]()
    for signal in reader.signals:
        at_time, trace = by_clock[signal.clock], by_value[signal.value]
        at = np.flatnonzero(np.isfinite(at_time) & np.isfinite(trace))
        threshold = Threshold(0.5, 0.0) if is_digital else find_threshold(trace[at])
        crossings = list(_crossings(at_time[at], trace[at], threshold)) if threshold else []
        for n, tick, is_high in crossings:
            level = "high" if is_high else "low"
            moment = float(at_time[at[n]]) if is_digital else tick
            event = TimerEvent(origin + round(moment), signal.label, level, lines[at[n]])
            reader.put((0, signal.run), signal.run, 0, event)
        if threshold is None:
            span = {"low": float(trace[at].min()), "high": float(trace[at].max())}
            notes.append(make_reason("no_passage", input=signal.label, **span))
        elif not is_digital:
            counted = {"crossings": len(crossings), "level": threshold.centre}
            notes.append(make_reason("crossings", input=signal.label, **counted))
    return notes


def _read_tick(
    reader: RowReader, row: Row, clock: TimerColumn | None, base: tuple[float, float]
) -> int | None:
    """Return when a sample was taken, ps; nothing where a trace ends before another."""
    if clock and clock.role == "time":
        return reader.read_time(row, clock)
    number = reader.read_time(row, clock) if clock else (reader.rows - 1) * TICK_HZ
    return None if number is None else round(TICK_HZ * base[0] + number * base[1])


def _level_of(text: str) -> float | None:
    """Return a level, or volts; NaN for an unknown one, `None` for another text."""
    if not text or text in "xXzZ":
        return np.nan
    return float(text) if is_number(text) else _LEVELS.get(state_of(text))


def _crossings(
    times: Array, volts: NDArray[np.float32], threshold: Threshold
) -> Iterator[tuple[int, float, bool]]:
    """Yield the sample behind each crossing, its moment, and whether it rises."""
    is_high = volts > threshold.centre
    sure = np.flatnonzero(np.abs(volts - threshold.centre) > threshold.half)
    turns = sure[1:][is_high[sure[1:]] != is_high[sure[:-1]]]
    crossings = np.flatnonzero(is_high[1:] != is_high[:-1]) + 1
    for n in crossings[np.searchsorted(crossings, turns, side="right") - 1]:
        share = (volts[n] - threshold.centre) / (volts[n] - volts[n - 1])
        yield int(n), float(times[n] - share * (times[n] - times[n - 1])), bool(is_high[n])


def find_threshold(volts: NDArray[np.float32]) -> Threshold | None:
    """Return the middle between two levels; `None` without two levels."""
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
    return Threshold(0.5 * (low + high), 0.5 * _HYSTERESIS * swing) if is_clear else None
