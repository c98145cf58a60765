"""Samples as passages: levels of a logic analyser, and volts with a threshold and hysteresis."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from rig.timers.columns import as_float, find_label
from rig.timers.edges_csv import TICK_HZ
from rig.timers.passages import Passage, moment
from rig.timers.table import Row, is_number
from rig.timers.vocabulary import has_role, number_of, state_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import RowBlock, Table

    Array = NDArray[np.float64]

_RATE = re.compile(r"([0-9.,]{1,20})\s?([kMG]?)Hz", re.IGNORECASE)
_NAMES = re.compile(r"channels\s?(?:\([0-9/ ]{1,12}\))?\s?:\s?(.{1,400})", re.IGNORECASE)
_SETTING = re.compile(r"[=:]\s?([+-]?[0-9][0-9.]{0,30}(?:[eE][+-]?[0-9]{1,3})?)")
_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""


def input_names(table: Table, width: int) -> list[str]:
    """Return a name for each column of levels without headings: as a remark lists, or D0, D1."""
    for remark in table.remarks:
        match = _NAMES.search(remark)
        names = match[1].split(",") if match else []
        if len(names) == width:
            return [n if number_of(n) is not None else f"input {n}" for n in map(str.strip, names)]
    return [f"D{n}" for n in range(width)]


def time_base(block: RowBlock, table: Table) -> tuple[float, float] | None:
    """Return the first sample's time and the step, s, that settings state; `None` without."""
    for remark in table.remarks:
        match = _RATE.search(remark) if has_role(remark, "rate") else None
        if match:
            power = {"": 0, "k": 3, "m": 6, "g": 9}[match[2].lower()]
            return 0.0, 1.0 / (float(match[1].replace(",", ".")) * 10.0**power)
    start, step = (_setting(block, role) for role in ("start", "step"))
    return None if not step else (start or 0.0, step)


def _setting(block: RowBlock, role: str) -> float | None:
    """Return the number that stands behind, or below, the name of a setting."""
    for above, below in zip(block.headings, [*block.headings[1:], Row(0, [])], strict=False):
        for n, text in enumerate(above.texts):
            if len(text) > 60 or not has_role(text, role):
                continue
            inside = _SETTING.search(text)
            for place in (inside[1] if inside else "", above.cell(n + 1), below.cell(n)):
                if is_number(place):
                    return float(place.replace(",", "."))
    return None


class SampleReader:
    """Reads the inputs that stand beside each other in rows of samples.

    Attributes
    ----------
    passages
        Of all inputs.
    begins
        The level that each input begins with.
    crossings
        Of volts: how many, and of which level, by input.
    idle
        Of volts where nothing passes: the least and the greatest, by input.
    step_s
        Between samples; 0 where they are not at regular times.
    """

    def __init__(
        self, block: RowBlock, columns: Sequence[TimerColumn], table: Table, problems: ProblemList
    ) -> None:
        self.passages: list[Passage] = []
        self.begins: dict[str, bool] = {}
        self.crossings: dict[str, tuple[int, float]] = {}
        self.idle: dict[str, tuple[float, float]] = {}
        self._block, self._table, self._problems = block, table, problems
        self._time = next((column for column in columns if column.role == "time"), None)
        base = time_base(block, table)
        rows = len(block.rows)
        self._times: Array
        if self._time is not None:
            self._times = self._floats(self._time, "a time") * 10.0 ** -(self._time.power or 0)
            for n in np.flatnonzero(np.diff(self._times) < 0.0)[:50].tolist():
                line = block.rows[n + 1]
                text = table.row(line).cell(self._time.at)
                place = table.column(line, self._time.at)
                problems.add(line, place, "time", "backwards", text=text)
        elif base is not None:
            self._times = base[0] + base[1] * np.arange(rows, dtype=np.float64)
        else:
            problems.refuse(block.rows[0], 1, "no_rate", lacks="a column of times or a rate")
        steps = np.diff(self._times) if rows > 1 else np.zeros(1)
        middle = float(np.median(steps))
        self.step_s = middle if float(steps.max()) < 1.5 * middle else 0.0
        names = [c.name for c in columns]
        for column in columns:
            plain = names.count(column.name) > 1 or not find_label(column.name, "gate")
            label = column.gate if plain and column.gate else column.name
            if column.role == "level":
                self._read_levels(column, label)
            elif column.role == "volts":
                self._read_volts(column, label)

    def _floats(self, column: TimerColumn, accepted: str) -> Array:
        table = self._table

        def value(line: int) -> float:
            text = table.row(line).cell(column.at)
            if is_number(text):
                return as_float(text, table)
            time = moment(text, table, 0) if accepted == "a time" else None
            if time is not None:
                return time / TICK_HZ
            self._problems.reject(line, table.column(line, column.at), accepted[2:], text, accepted)
            return 0.0

        return np.fromiter(map(value, self._block.rows), float, len(self._block.rows))

    def _tick(self, n: int) -> int:
        """Return the time of a sample, ps, exactly as the file has it."""
        if self._time is None:
            return round(float(self._times[n]) * TICK_HZ)
        text = self._table.row(self._block.rows[n]).cell(self._time.at)
        return moment(text, self._table, self._time.power or 0) or 0

    def _read_levels(self, column: TimerColumn, label: str) -> None:
        current: bool | None = None
        for n, line in enumerate(self._block.rows):
            text = self._table.row(line).cell(column.at)
            state = state_of(text)
            if text.casefold() in {"x", "z", ""}:
                continue
            if state not in {"high", "low", "one", "zero"}:
                place = self._table.column(line, column.at)
                self._problems.reject(line, place, label, text, "a level: 0 or 1")
                continue
            high = state in {"high", "one"}
            if current is None:
                self.begins[label] = high
            elif high is not current:
                self.passages.append(Passage(self._tick(n), label, None, high, line))
            current = high

    def _read_volts(self, column: TimerColumn, label: str) -> None:
        """Find where volts cross the middle between dark and bright, with hysteresis.

        Between two samples the crossing of the middle is where a straight line has it.
        """
        volts, times = self._floats(column, "a number of volts"), self._times
        middle = find_middle(volts)
        if middle is None:
            self.idle[label] = float(volts.min()), float(volts.max())
            return
        centre, half = middle
        high = self.begins[label] = bool(volts[0] > centre)
        count = len(self.passages)
        for n in np.flatnonzero(np.abs(volts - centre) > half).tolist():
            if bool(volts[n] > centre) is high:
                continue
            high = not high
            k = n  # back to where it crossed the middle
            while k > 0 and (volts[k - 1] > centre) == high:
                k -= 1
            a, b = float(volts[k - 1]), float(volts[k])
            share = (centre - a) / (b - a) if b != a else 1.0
            time = float(times[k - 1] + share * (times[k] - times[k - 1]))
            line = self._block.rows[k]
            self.passages.append(Passage(round(time * TICK_HZ), label, None, high, line))
        self.crossings[label] = len(self.passages) - count, centre


def find_middle(volts: Array) -> tuple[float, float] | None:
    """Return the middle between two levels and half the hysteresis; `None` without two levels."""
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
