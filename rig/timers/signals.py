"""Rows of a table as changes: what each column says at a time, and when that changes.

A column of volts, of levels or of states, and a column of times alone, are all the same thing: at a
time, an input had a value.
"""

from __future__ import annotations

import itertools
from array import array
from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rig.reasons import make_reason
from rig.timers.columns import SAMPLED, TimerColumn, columns_of, pair_columns, roles
from rig.timers.crossings import find_crossings, find_threshold
from rig.timers.moments import OVERFLOWS_PS, TICK_HZ, moment
from rig.timers.table import Row
from rig.timers.vocabulary import is_number, state_of

if TYPE_CHECKING:
    from rig.timers.timer_file import TimerFile

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
_TURN = 600 * TICK_HZ
"""Picoseconds from a time to the next within which a counter is taken to have begun anew."""
STATES = ("", "clear", "blocked", "low", "high")
"""What begins with a change, of a beam or of a signal; nothing where the file does not say."""
_REJECTED = len(STATES)
"""What a cell says that is not accepted; one that says nothing is 0."""
CHANGE = np.dtype(
    {
        "names": ["line", "tick", "rank", "state", "label", "run", "clock", "block", "first"],
        "formats": ["i4", "O", "i4", "i1", "i4", "i4", "i4", "i4", "?"],
    }
)
"""A change at an input: its line; its time, ps (of a date it needs more than 64 bits), and how many
times are before it; which of `STATES` begins; what the file calls the input and the run (places in
`TimerFile.names`); which column of times it is of, where several are alike; the block of rows; and
whether it is a first row, which may say the state at the beginning."""
Changes: TypeAlias = NDArray[Any]
"""Rows of `CHANGE`."""


class SignalReader:
    """Reads rows whose columns are the same.

    Parameters
    ----------
    sample
        The first of them, which show what the columns are.

    Attributes
    ----------
    is_sampled
        Whether rows say what an input was, whether that changed or not.
    is_whole
        Whether each row says the states of all inputs, so that those that differ are changes;
        otherwise each state is.
    """

    def __init__(self, file: TimerFile, sample: list[Row]) -> None:
        columns = columns_of(file, sample[0].block, sample)
        self.file, self.signals = file, pair_columns(columns)
        self.clocks = list(dict.fromkeys(signal.clock for signal in self.signals))
        used = {column.role for column in columns}
        values = [signal.value.at for signal in self.signals if signal.value.role != "moment"]
        filled = {x.at: sum(row.cell(x.at) != "" for row in sample) for x in columns}
        total = sum(filled[at] for at in values)
        is_filled = len(values) == 1 or 2 * total >= (len(values) + 1) * len(sample)
        named = [x for x in columns[::-1] if x.role in {"run", "gate"} and "volts" not in used]
        self.places = {x.role: x.at for x in named}
        self.above = {x: "" for x, at in self.places.items() if 2 * filled[at] <= len(sample)}
        self.is_sampled = "volts" in used or ("level" in used and is_filled)
        self.is_whole = is_filled and (self.is_sampled or len(values) > len(self.clocks))
        needed = {x.at for signal in self.signals for x in signal[:2]} | {*self.places.values()}
        unused = (x.name for x in columns if x.role != "index" and x.at not in needed)
        self.unused = ", ".join(unused)
        file.notes += [make_reason("columns_unused", columns=self.unused)] if self.unused else []
        file.lines += [f"  {column.name}: {column.meaning}" for column in columns]
        file.is_sampled |= self.is_sampled
        is_named = any(clock.run for clock in self.clocks)
        file.is_wide |= len(self.clocks) > 1 and not (self.is_sampled or is_named)
        file.is_guess |= bool(self.above)
        file.has_runs |= "run" in self.places

    def read(self, rows: Iterator[Row]) -> list[Changes]:
        """Return the changes that rows say; a row may say that nothing changes, or be unread.

        Rows of samples without times are at a stated rate.
        """
        file, first = self.file, next(rows)
        base = (0.0, 1.0) if self.clocks[0].role == "time" else first.block.find_time_base()
        if base is None:
            file.problems.refuse(first.line, 1, "no_rate", lacks="a column of times or a rate")
        self.base, self.count = base, 0
        self.starts, self.latest = dict[int, int](), dict[int, int]()
        self.values, self.keys = dict[int, tuple[int, ...]](), set[tuple[int, ...]]()
        self.changes, self.samples = list[Any](), [array("d") for _ in self.signals]
        for row in itertools.chain([first], rows):
            ticks = {clock.at: self._read_time(row, clock) for clock in self.clocks}
            is_read = False
            for n, signal in enumerate(self.signals):
                word, tick = row.cell(signal.value.at), ticks[signal.clock.at]
                is_said = word or self.is_sampled or signal.value.role == "moment"
                if tick is not None and is_said:
                    self._read_value(n, row, word, tick)
                    is_read = True
            file.unread += [] if is_read else [row.line]
            self.count += 1
            if len(self.changes) > MAX_EVENTS:
                file.problems.refuse(row.line, 1, "too_many_events", limit=MAX_EVENTS)
        file.rows += self.count
        if self.unused and not self.places and self.signals[0].value.role == "moment":
            steps = [b[1] - a[1] for a, b in itertools.pairwise(self.changes)]
            if len(steps) > 3 and max(steps) < 1.5 * min(steps):
                file.problems.refuse(first.line, 1, "regular_samples", columns=self.unused)
        volts = [n for n, signal in enumerate(self.signals) if signal.value.role == "volts"]
        parts = [np.array(self.changes, CHANGE), *map(self._find_crossings, volts)]
        silent = self.count - len({line for part in parts for line in part["line"].tolist()})
        if self.is_sampled and 2 * silent > self.count:
            lasting = max(self.latest.values()) - min(self.starts.values())
            file.period = lasting // max(1, self.count - 1)
        return parts

    def _read_time(self, row: Row, clock: TimerColumn) -> int | None:
        """Return the time of a row, ps; `None` where it says nothing."""
        text = row.cell(clock.at) if clock.at >= 0 else str(self.count)
        tick = moment(text, clock.power or 0)
        if tick is None:
            if text:
                self._reject(row, clock, text)
            return None
        if clock.role != "time":
            tick = round(self.base[0] * TICK_HZ + self.base[1] * tick)
        latest = self.latest.get(clock.at, tick)
        for wrap in OVERFLOWS_PS.get(clock.power, ()) if tick < latest else ():
            pause = (tick - latest) % wrap
            tick = latest + pause if pause < _TURN else tick
        if self.is_sampled and tick < latest:
            self.file.problems.add(*row.place(clock.at), "time", "backwards", text=text)
        self.starts.setdefault(clock.at, tick)
        self.latest[clock.at] = tick
        return tick

    def _read_value(self, n: int, row: Row, word: str, tick: int) -> None:
        """Keep what a cell says: a sample of volts, or a state if that is a change."""
        signal, names, block = self.signals[n], self.file.names, row.block
        value = signal.value
        if value.role == "volts" and is_number(word):
            offset = tick - self.starts[signal.clock.at]
            self.samples[n].extend((row.line, offset, float(word)))
            return
        state = code_of(value.role, value.words.get(word, word) or value.state)
        if state == _REJECTED:
            self._reject(row, value, word)
        elif state or not self.is_sampled:
            name = self._read_name(row, "run") or signal.run or block.run
            run = names.setdefault(name, len(names))
            before, self.values[n] = self.values.get(n), (state, run)
            if self.is_whole and before == self.values[n]:
                return
            label = self._read_name(row, "gate") or signal.label or block.gate
            key = n, run, names.setdefault(label, len(names))
            # A first row may be the state at the beginning of a run, and no change.
            is_first = self.is_whole and key not in self.keys
            self.keys.add(key)
            at = signal.clock.at
            self.changes.append(
                (row.line, tick, 0, state, key[-1], run, at, block.number, is_first)
            )

    def _read_name(self, row: Row, role: str) -> str:
        """Return what a row says of its run or gate; of merged cells only the first has a text."""
        text = row.cell(self.places[role]) if role in self.places else ""
        if role in self.above:
            text = self.above[role] = text or self.above[role]
        return text

    def _find_crossings(self, n: int) -> Changes:
        """Return where volts cross the middle; note how many do, or that nothing passes."""
        label, start = self.signals[n].label, self.starts.get(self.signals[n].clock.at, 0)
        samples = np.array(self.samples[n]).reshape(-1, 3)
        volts = samples[:, 2]
        if (threshold := find_threshold(volts)) is None:
            limits = {"low": min(volts, default=0), "high": max(volts, default=0)}
            self.file.notes.append(make_reason("no_passage", input=label, **limits))
            return np.empty(0, CHANGE)
        lines, offsets, is_high = find_crossings(samples, threshold).T
        counts = {"crossings": len(lines), "level": threshold[0]}
        self.file.notes.append(make_reason("crossings", input=label, **counts))
        changes = np.zeros(len(lines), CHANGE)
        changes["line"], changes["state"] = lines, STATES.index("low") + is_high
        changes["tick"] = [start + round(offset) for offset in offsets.tolist()]
        changes["label"] = self.file.names.setdefault(label, len(self.file.names))
        return changes

    def _reject(self, row: Row, column: TimerColumn, text: str) -> None:
        """Note a cell whose value is not accepted."""
        accepted = roles()[column.role][1]
        self.file.problems.reject(*row.place(column.at), column.role, text, accepted)


@lru_cache(10_000)
def code_of(role: str, word: str) -> int:
    """Return what a word means in such a column: a place in `STATES`, or the one behind them."""
    state, accepted = state_of(word), roles()[role][-1].split()
    if state in {"unknown", "missing"} and role in {*SAMPLED, "moment"}:
        return 0
    state = dict(zip(("zero", "one"), accepted, strict=False)).get(state, state)
    return STATES.index(state) if state in accepted else _REJECTED
