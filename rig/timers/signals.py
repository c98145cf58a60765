"""Columns as signals: which times belong to which states, levels or volts, of which input and run.

A level is a signal of 0 and 1. Volts become one with hysteresis around the middle between dark and
bright; they change where a straight line between two samples crosses that middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rig.timers.vocabulary import is_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.timers.columns import TimerColumn

_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""
_SCATTER = 1.4826
"""Standard deviation over the median of absolute deviations, of normal noise."""
VALUES = (("level", "volts"), ("state",), ("edge",), ())
"""Roles that say what happened; of a table that has several, the first are read."""


@dataclass(eq=False, slots=True)
class Signal:
    """A column of times with the column that says what happened, of an input and of a run.

    Attributes
    ----------
    clock
        Of its times, or of the numbers of its samples; `None` where rows are counted.
    value
        Its states, levels or volts; `None` where all its times are of the same kind.
    threshold
        Of volts.
    level
        Of samples, the last one.
    """

    clock: TimerColumn | None
    value: TimerColumn | None
    label: str
    run: str
    threshold: Threshold | None = None
    level: str = ""

    def is_news(self, level: str | None) -> bool:
        """Whether a further sample has another level than the one before."""
        before, self.level = self.level, level or self.level
        return before not in {"", self.level}

    @property
    def is_sampled(self) -> bool:
        """Whether most of its values say that nothing changes."""
        return self.value is not None and self.value.role in VALUES[0]

    @property
    def state(self) -> str:
        """What the heading says of all times: ``blocked``, ``clear``, or nothing."""
        states = {None: "", True: "blocked", False: "clear"}
        return states[self.clock.blocked] if self.clock else ""


@dataclass(slots=True)
class Threshold:
    """The middle between two levels, half the hysteresis, and where volts crossed it last."""

    centre: float
    half: float
    tick: int = 0
    line: int = 0
    _last: tuple[int, float] | None = None

    def follow(self, tick: int, volts: float, line: int) -> str:
        """Return the level of a further sample; nothing where it is too near to the middle."""
        before, last = self._last or (tick, volts)
        if (volts > self.centre) is not (last > self.centre):
            share = (volts - self.centre) / (volts - last)
            self.tick, self.line = tick - round(share * (tick - before)), line
        self._last = tick, volts
        if abs(volts - self.centre) <= self.half:
            return ""
        return "high" if volts > self.centre else "low"


@lru_cache(100_000)
def volts_of(text: str) -> float | None:
    """Read a voltage; `None` for another text. Those of a converter are few, again and again."""
    return float(text) if is_number(text) else None


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


def find_signals(columns: Sequence[TimerColumn]) -> list[Signal]:
    """Give each column of times the values that belong to it: of its run, and of its input."""
    chosen = ([c for c in columns if c.role in roles] for roles in VALUES)
    values = next(filter(None, chosen), [])
    times = [column for column in columns if column.role == "time"]
    count = next((column for column in columns if column.role == "index"), None)
    signals = [
        Signal(clock, value, "", clock.run or value.run if value else clock.run)
        for clock in times
        for value in _values_of(clock, times, values) or (None,)
    ] or [Signal(count, value, "", value.run) for value in values]
    if any(signal.is_sampled for signal in signals):
        signals = [signal for signal in signals if signal.value]
    for signal in signals:
        signal.label = _label_of(signal, signals)
    return signals


def _values_of(
    clock: TimerColumn, times: Sequence[TimerColumn], values: Sequence[TimerColumn]
) -> list[TimerColumn]:
    """Return the values whose times a column has: those of its gate, or the nearest ones."""
    beside = [signal for signal in times if signal.run == clock.run]
    own = [value for value in values if not clock.run or value.run in {clock.run, ""}]
    if len(beside) == 1:
        return own
    near = [v for v in own if clock is min(beside, key=lambda c: (c.at > v.at, abs(c.at - v.at)))]
    return [value for value in own if clock.gate and value.gate == clock.gate] or near[-1:]


def _label_of(signal: Signal, signals: Sequence[Signal]) -> str:
    """Return what the file calls an input: its heading, or only the gate's name in it."""
    clock, value = signal.clock, signal.value
    if value is None:
        gate = clock.gate if clock else ""
        alike = [s for s in signals if s.clock and s.clock.gate == gate]
        is_own = (
            len(alike) == 1 and clock and gate in clock.name and not (clock.run or signal.state)
        )
        return clock.name if clock and gate and is_own else gate
    if signal.is_sampled:
        return value.name if value.gate in value.name or not value.gate else value.gate
    if sum(item.clock is clock for item in signals) > 1:
        return value.gate or value.name
    is_only = all(item.clock is clock or item.run != signal.run for item in signals)
    return (clock.gate if clock else "") or ("" if is_only else value.gate)
