"""Samples as passages: levels of a logic analyser, and volts with a threshold and hysteresis."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np

from rig.reasons import make_reason
from rig.timers.columns import as_float, find_label, has_levels
from rig.timers.edges_csv import TICK_HZ
from rig.timers.passages import Passage, moment
from rig.timers.table import Row, is_number
from rig.timers.vocabulary import POWERS, has_role, state_of, unit_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.reasons import Reason
    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import RowBlock, Table

    Array = NDArray[np.float64]

_RATE = re.compile(r"([0-9.,]{1,20})\s?([kMG]?)Hz", re.IGNORECASE)
_NAMES = re.compile(r"channels\s?(?:\([0-9/ ]{1,12}\))?\s?:\s?(.{1,400})", re.IGNORECASE)
_SETTING = re.compile(r"[=:]\s?([+-]?[0-9].{0,40})")
_QUANTITY = re.compile(
    r"([+-]?[0-9][0-9.,]{0,30}(?:[eE][+-]?[0-9]{1,3})?)\s?([a-zµμ]{0,3})", re.IGNORECASE
)
_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
LEVELS = {"high": 1.0, "one": 1.0, "low": 0.0, "zero": 0.0}
_UNKNOWN = {"x", "z", ""}
_ACCEPTED = {
    "time": "a time",
    "index": "a number of the sample",
    "level": "a level: 0 or 1",
    "volts": "a number of volts",
}
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""


def name_levels(block: RowBlock, table: Table) -> list[Row]:
    """Return a heading for levels that have none, only a rate: as a remark lists, or D0, D1."""
    first, *_ = rows = [table.row(line).texts for line in block.rows[:200]]
    own = {text.casefold() for text in block.headings[-1].texts} if block.headings else set()
    if own - {"logic", "analog"} or not time_base(block, table) or not all(map(has_levels, rows)):
        return []
    lists = [match[1].split(",") for remark in table.remarks if (match := _NAMES.search(remark))]
    names = next((names for names in lists if len(names) == len(first)), None)
    texts = [f"D{n}" for n in range(len(first))] if names is None else names
    numbered = (text.strip() for text in texts)
    return [Row(0, [t if find_label(t, "gate") else f"input {t}" for t in numbered])]


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
    """Return the number that stands behind, or below, the name of a setting, in s."""
    for above, below in zip(block.headings, [*block.headings[1:], Row(0, [])], strict=False):
        for n, text in enumerate(above.texts):
            if len(text) > 60 or not has_role(text, role):
                continue
            inside = _SETTING.search(text)
            for place in (inside[1] if inside else "", above.cell(n + 1), below.cell(n)):
                if match := _QUANTITY.fullmatch(place):
                    power = POWERS.get(unit_of(match[2].lower()), 0)
                    return float(match[1].replace(",", ".")) * 10.0**-power
    return None


class SampleReader:
    """Reads the inputs that stand beside each other in rows of samples.

    A level is a signal of 0 and 1: it changes where a row has it otherwise than the row before.
    Volts change where a straight line between two samples crosses the middle between dark and
    bright; both sides of the hysteresis lie around it.

    Attributes
    ----------
    passages
        Of all inputs.
    begins
        The level that each input begins with.
    notes
        What was seen of inputs in volts.
    step_s
        Between samples; 0 where they are not at regular times.
    """

    def __init__(
        self, block: RowBlock, columns: Sequence[TimerColumn], table: Table, problems: ProblemList
    ) -> None:
        self.passages: list[Passage] = []
        self.begins: dict[str, bool] = {}
        self.notes: list[Reason] = []
        self._block, self._table, self._problems = block, table, problems
        inputs = [column for column in columns if column.role in {"level", "volts"}]
        self._time = next((column for column in columns if column.role == "time"), None)
        self._index = next((column for column in columns if column.role == "index"), None)
        self._times = self._read_times()
        steps = np.diff(self._times) if len(block.rows) > 1 else np.zeros(1)
        middle = float(np.median(steps))
        self.step_s = middle if float(steps.max()) < 1.5 * middle else 0.0
        names = [column.name for column in columns]
        samples = self._read_cells(inputs)
        for column, values in zip(inputs, samples.T, strict=True):
            plain = names.count(column.name) > 1 or not find_label(column.name, "gate")
            label = column.gate if plain and column.gate else column.name
            self._find_passages(label, values, column.role == "level")

    def _read_times(self) -> Array:
        block, table = self._block, self._table
        base = time_base(block, table)
        if self._time is not None:
            times = self._read_cells([self._time])[:, 0]
        elif base is not None:
            numbers = np.arange(len(block.rows), dtype=np.float64)
            if self._index is not None:  # a row may be missing
                numbers = self._read_cells([self._index])[:, 0]
            return np.asarray(base[0] + base[1] * (numbers - numbers[0]), dtype=np.float64)
        else:
            self._problems.refuse(block.rows[0], 1, "no_rate", lacks="a column of times or a rate")
        for n in np.flatnonzero(np.diff(times) < 0.0)[:50].tolist():
            line = block.rows[n + 1]
            place = table.column(line, self._time.at)
            text = table.row(line).cell(self._time.at)
            self._problems.add(line, place, "time", "backwards", text=text)
        return times

    def _read_cells(self, columns: Sequence[TimerColumn]) -> Array:
        """Return columns as numbers, shape ``(rows, columns)``; times in s."""
        values = (
            self._read_cell(column, row)
            for row in map(self._table.row, self._block.rows)
            for column in columns
        )
        count = len(self._block.rows) * len(columns)
        return np.fromiter(values, float, count).reshape(-1, len(columns))

    def _read_cell(self, column: TimerColumn, row: Row) -> float:
        text = row.cell(column.at)
        if column.role == "level" and (text.casefold() in _UNKNOWN or state_of(text) in LEVELS):
            return LEVELS.get(state_of(text), math.nan)
        if column.role != "level" and is_number(text):
            return as_float(text, self._table) * 10.0 ** -(column.power or 0)
        time = moment(text, self._table, 0) if column.role == "time" else None
        if time is None:
            accepted = _ACCEPTED[column.role]
            place = self._table.column(row.line, column.at)
            self._problems.reject(row.line, place, accepted[2:], text, accepted)
        return (time or 0) / TICK_HZ

    def _tick(self, n: int) -> int:
        """Return the time of a sample, ps, exactly as the file has it."""
        if self._time is None:
            return round(float(self._times[n]) * TICK_HZ)
        text = self._table.row(self._block.rows[n]).cell(self._time.at)
        return moment(text, self._table, self._time.power or 0) or 0

    def _find_passages(self, label: str, values: Array, is_level: bool) -> None:
        middle = (0.5, 0.0) if is_level else find_middle(values)
        if middle is None:
            low, high = float(values.min()), float(values.max())
            self.notes.append(make_reason("no_passage", input=label, low=low, high=high))
            return
        centre, half = middle
        firm = np.flatnonzero(np.abs(values - centre) > half)
        if not firm.size:
            return
        above = values[firm] > centre
        self.begins[label] = bool(above[0])
        changes = np.flatnonzero(np.diff(above)) + 1
        for before, n, high in zip(firm[changes - 1], firm[changes], above[changes], strict=True):
            k, tick = int(n), 0
            if is_level:
                tick = self._tick(k)
            else:  # back to where it crossed the middle
                k = int(before + np.flatnonzero((values[before : n + 1] > centre) != high)[-1]) + 1
                share = (centre - values[k - 1]) / (values[k] - values[k - 1])
                time = self._times[k - 1] + share * (self._times[k] - self._times[k - 1])
                tick = round(float(time) * TICK_HZ)
            self.passages.append(Passage(tick, label, None, bool(high), self._block.rows[k]))
        if not is_level:
            values_said = {"input": label, "crossings": changes.size, "level": centre}
            self.notes.append(make_reason("crossings", **values_said))


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
