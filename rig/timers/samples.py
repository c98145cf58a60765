"""Samples as passages: levels of a logic analyser, and volts with a threshold and hysteresis."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from rig.timers.edges_csv import TICK_HZ
from rig.timers.passages import Passage, moment
from rig.timers.table import FALLING, NO_LEVEL, RISING, as_state

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.timers.columns import Columns
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row

    Array = NDArray[np.float64]

_RATE = re.compile(r"sample ?rate\s*:?\s*([0-9.,]+)\s*([kMG]?)Hz", re.IGNORECASE)
_NAMES = re.compile(r"channels\s*(?:\([0-9/ ]+\))?\s*:\s*(.+)", re.IGNORECASE)
_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""


def sample_rate_hz(remarks: Sequence[str]) -> float | None:
    """Rate that a remark of the file states; `None` without one."""
    for remark in remarks:
        match = _RATE.search(remark)
        if match:
            power = {"": 0, "k": 3, "m": 6, "g": 9}[match[2].lower()]
            return float(match[1].replace(",", ".")) * 10.0**power
    return None


def input_names(remarks: Sequence[str]) -> list[str]:
    """Names of inputs that a remark lists; none without one."""
    for remark in remarks:
        match = _NAMES.search(remark)
        if match:
            return [name.strip() for name in match[1].split(",")]
    return []


def level_passages(
    rows: Sequence[Row],
    columns: Columns,
    times: Sequence[int],
    problems: ProblemList,
) -> tuple[list[Passage], dict[str, bool]]:
    """Find the changes of levels.

    Parameters
    ----------
    times
        Of each row, ps.

    Returns
    -------
    list of Passage, dict
        Changes, and the level that each input begins with.
    """
    passages: list[Passage] = []
    begins: dict[str, bool] = {}
    current: dict[str, bool] = {}
    for row, time in zip(rows, times, strict=True):
        for at, label in columns.levels.items():
            cell = row.cell(at)
            level = as_state(cell.text)
            if level in NO_LEVEL or not level:
                continue
            if level not in RISING | FALLING:
                problems.reject(row.line, cell.column, label, cell.text, "a level: 0 or 1")
                continue
            high = level in RISING
            if high is not current.get(label, begins.setdefault(label, high)):
                passages.append(Passage(time, label, None, high))
            current[label] = high
    return passages, begins


def volt_passages(
    label: str, times: Sequence[int], volts: Array
) -> tuple[list[Passage], bool, float] | None:
    """Find where volts cross the middle between dark and bright, with hysteresis.

    Between two samples the crossing of the middle is where a straight line has it.

    Parameters
    ----------
    label
        Name of the input.
    times
        Of each sample, ps.
    volts
        Shape ``(samples,)``.

    Returns
    -------
    list of Passage, bool, float
        Crossings, whether the input begins high, and the middle in volts. `None` where there is
        nothing but noise.
    """
    middle = _middle(volts)
    if middle is None:
        return None
    centre, half = middle
    high = bool(volts[0] > centre)
    begins = high
    passages: list[Passage] = []
    for n in np.flatnonzero(np.abs(volts - centre) > half).tolist():
        if bool(volts[n] > centre) is high:
            continue
        high = not high
        k = n  # back to where it crossed the middle
        while k > 0 and (volts[k - 1] > centre) == high:
            k -= 1
        a, b = float(volts[k - 1]), float(volts[k])
        share = (centre - a) / (b - a) if b != a else 1.0
        passages.append(
            Passage(times[k - 1] + round(share * (times[k] - times[k - 1])), label, None, high)
        )
    return passages, begins, centre


def _middle(volts: Array) -> tuple[float, float] | None:
    """Middle between the two levels and half the hysteresis; `None` without two levels."""
    low, high = np.quantile(volts, [0.0, 1.0])
    for _ in range(50):  # two means, one for each level
        centre = 0.5 * (low + high)
        above = volts > centre
        if above.all() or not above.any():
            return None
        next_low, next_high = np.median(volts[~above]), np.median(volts[above])
        if next_low == low and next_high == high:
            break
        low, high = next_low, next_high
    above = volts > 0.5 * (low + high)
    swing = float(high - low)
    noise = max(
        float(np.median(np.abs(volts[mask] - np.median(volts[mask])))) for mask in (above, ~above)
    )
    if swing <= 0.0 or swing < _CLEAR_SWING * 1.4826 * noise:
        return None
    return 0.5 * float(low + high), 0.5 * _HYSTERESIS * swing


def sample_times(
    rows: Sequence[Row],
    columns: Columns,
    separator: str,
    rate_hz: float | None,
    problems: ProblemList,
) -> list[int]:
    """Times of samples, ps: from their column, else from the rate."""
    if not columns.times:
        assert rate_hz is not None
        return [round(n * TICK_HZ / rate_hz) for n in range(len(rows))]
    column = columns.times[0]
    ticks: list[int] = []
    for row in rows:
        cell = row.cell(column.at)
        time = moment(cell.text, separator, column.power)
        if time is None:
            problems.reject(row.line, cell.column, "time", cell.text, "a time")
            time = ticks[-1] if ticks else 0
        elif ticks and time < ticks[-1]:
            problems.add(row.line, cell.column, "time", "backwards", text=cell.text)
        ticks.append(time)
    return ticks
