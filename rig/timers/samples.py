"""Samples as events: levels of a logic analyser, and volts with a threshold and hysteresis.

A level is a signal of 0 and 1: it changes where a row has it otherwise than the row before. Volts
change where a straight line between two samples crosses the middle between dark and bright; both
sides of the hysteresis lie around it.
"""

from __future__ import annotations

from array import array
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.reasons import make_reason
from rig.timers.events import TICK_HZ, FilePart, TimerEvent, moment
from rig.timers.vocabulary import find_label, is_number, state_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row
    from rig.timers.timer_file import TimerFile

_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""
_LEVELS = {"high": 1, "one": 1, "low": 0, "zero": 0, "x": -1, "z": -1}
_ACCEPTED = {
    "time": "a time",
    "index": "a number of the sample",
    "level": "a level: 0 or 1",
    "volts": "a number of volts",
}
_AT_ONCE = 10_000
"""Rows turned into numbers together."""


def read_samples(
    file: TimerFile,
    rows: Iterator[Row],
    columns: Sequence[TimerColumn],
    base: tuple[float, float] | None,
    problems: ProblemList,
) -> None:
    """Read the inputs that stand beside each other, and find where they change.

    Parameters
    ----------
    file
        What is known of the file, to which events, levels, rows and notes are added.
    base
        Of samples without times: when the first was taken, and the time between them, s.
    """
    inputs = [column for column in columns if column.role in {"level", "volts"}]
    clock = next((c for role in ("time", "index") for c in columns if c.role == role), None)
    lines, stamps = array("i"), array("d")
    values = [array("b" if column.role == "level" else "f") for column in inputs]
    origin: int | None = None
    longest = usual = 0.0
    while batch := list(islice(rows, _AT_ONCE)):
        lines.extend(row.line for row in batch)
        for column, cells in zip(inputs, values, strict=True):
            cells.extend(_read_column(batch, column, problems))
        if clock is not None:
            ticks = _read_column(batch, clock, problems)
            origin = ticks[0] if origin is None else origin
            before = stamps[-1] if stamps else 0.0
            stamps.extend(tick - origin for tick in ticks)
            steps = np.diff(stamps[-len(ticks) :], prepend=before)
            for row in (batch[n] for n in np.flatnonzero(steps < 0.0).tolist()):
                place, text = row.column(clock.at), row.cell(clock.at)
                problems.add(row.line, place, "time", "backwards", text=text)
            longest, usual = max(longest, float(steps.max())), usual or float(np.median(steps))
    scale, start = (1.0, origin or 0) if base is None else (base[1], round(TICK_HZ * base[0]))
    is_regular = not clock or longest < 1.5 * usual
    step_s = scale * (usual / TICK_HZ if clock else 1.0) if is_regular else 0.0
    file.period_s = step_s or None
    file.parts.append(FilePart())
    names = [column.name for column in columns]
    for column, cells in zip(inputs, values, strict=True):
        plain = names.count(column.name) > 1 or not find_label(column.name, "gate")
        label = column.gate if plain and column.gate else column.name
        for k, share, high in _find_changes(file, label, np.asarray(cells)):
            after, before = (
                (stamps[k], stamps[k - 1]) if clock else (k * TICK_HZ, (k - 1) * TICK_HZ)
            )
            tick = start + round(scale * (after - share * (after - before)))
            event = TimerEvent(tick, label, "high" if high else "low", lines[k])
            file.parts[-1].events.append(event)
    changing = {event.line for event in file.parts[-1].events}
    file.sampled |= changing
    file.rows += len(lines)
    file.silent += len(lines) - len(changing)


def _read_column(rows: Sequence[Row], column: TimerColumn, problems: ProblemList) -> list[Any]:
    """Return what rows have in a column: ticks, levels (-1 where unknown) or volts."""
    read: dict[str, Any] = {}  # by text, for levels are few
    values = []
    for row in rows:
        text = row.cell(column.at)
        value = read.get(text)
        if value is None:
            if column.role == "level":
                value = read[text] = _LEVELS.get(state_of(text) or text.casefold() or "x")
            elif column.role == "volts":
                value = float(text) if is_number(text) else None
            else:
                value = moment(text, column.power or 0)
        if value is None:
            place, accepted = row.column(column.at), _ACCEPTED[column.role]
            problems.reject(row.line, place, accepted[2:], text, accepted)
        values.append(value or 0)
    return values


def _find_changes(
    file: TimerFile, label: str, values: NDArray[Any]
) -> Iterator[tuple[int, float, bool]]:
    """Yield each change: the first sample after it, how far before that it is, and whether up."""
    is_level = values.dtype == np.int8
    middle = (0.5, 0.0) if is_level else find_middle(values)
    if middle is None:
        low, high = float(values.min()), float(values.max())
        file.notes.append(make_reason("no_passage", input=label, low=low, high=high))
        return
    centre, half = middle
    last, count = np.zeros(0, np.intp), 0
    for begin in range(0, len(values), _AT_ONCE):
        part = values[begin : begin + _AT_ONCE]
        near = part >= 0 if is_level else np.abs(part - np.float32(centre)) > half
        firm = np.concatenate([last, begin + np.flatnonzero(near)])
        above = values[firm] > centre
        if firm.size:
            file.begins.setdefault(label, "high" if above[0] else "low")
        for n in (np.flatnonzero(np.diff(above)) + 1).tolist():
            k, share, high = int(firm[n]), 0.0, bool(above[n])
            if not is_level:  # back to where it crossed the middle
                before = int(firm[n - 1])
                k = before + 1 + int(
                    np.flatnonzero((values[before : k + 1] > centre) != high)[-1])  # fmt: skip
                share = (float(values[k]) - centre) / float(values[k] - values[k - 1])
            count += 1
            yield k, share, high
        last = firm[-1:]
    if not is_level:
        file.notes.append(make_reason("crossings", input=label, crossings=count, level=centre))


def find_middle(volts: NDArray[np.float32]) -> tuple[float, float] | None:
    """Return the middle between two levels and half the hysteresis; `None` without two levels."""
    low, high = float(volts.min()), float(volts.max())
    for _ in range(50):  # two means, one for each level
        above = volts > 0.5 * (low + high)
        if above.all() or not above.any():
            return None
        next_low, next_high = float(np.median(volts[~above])), float(np.median(volts[above]))
        if next_low == low and next_high == high:
            break
        low, high = next_low, next_high
    above = volts > 0.5 * (low + high)
    swing = high - low
    noise = max(
        float(np.median(np.abs(volts[mask] - np.median(volts[mask])))) for mask in (above, ~above)
    )
    if swing <= 0.0 or swing < _CLEAR_SWING * 1.4826 * noise:
        return None
    return 0.5 * (low + high), 0.5 * _HYSTERESIS * swing
