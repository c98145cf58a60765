"""Rows of a table as changes: what each column says at a time, and when that changes.

A column of volts, of levels or of states, and a column of times alone, are all the same thing: at a
time, an input had a value. Rows are read in chunks, a column at once.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import compress, islice, zip_longest
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rig.reasons import make_reason
from rig.timers.columns import ROW_COUNT, SAMPLED, pair_columns, roles
from rig.timers.crossings import find_crossings, find_threshold
from rig.timers.moments import LONGEST_S, TICK_HZ, moment
from rig.timers.vocabulary import is_number, state_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rig.arrays import Array, Flags
    from rig.timers.columns import ColumnPair, TimerColumn
    from rig.timers.table import Row, TimeBase
    from rig.timers.timer_file import TimerFile

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
_CHUNK = 5000
"""Rows that are read at once."""
STATES = ("", "clear", "blocked", "low", "high")
"""What begins with a change, of a beam or of a signal; nothing where the file does not say."""
_SILENT, _VOLTS, _REJECTED = 0, 5, 6
"""What a cell says beside `STATES`: nothing, a number of volts, or what is not accepted."""
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
Cells: TypeAlias = "Mapping[int, Sequence[str]]"
"""Cells of rows that are read at once, by their column."""


class SignalReader:
    """Reads rows whose columns are the same.

    Attributes
    ----------
    is_sampled
        Whether rows say what an input was, whether that changed or not.
    is_whole
        Whether each row says the states of all inputs, so that those that differ are changes;
        otherwise each state is.
    """

    def __init__(self, file: TimerFile, columns: list[TimerColumn], sample: list[Row]) -> None:
        self.file, self.pairs = file, pair_columns(columns)
        self.clocks = list(dict.fromkeys(pair.clock for pair in self.pairs))
        self.places = {column.role: column.at for column in reversed(columns)}
        self.is_sampled = not self.places.keys().isdisjoint(SAMPLED)
        values = [pair.value.at for pair in self.pairs if pair.value.role != "moment"]
        filled = sum(row.cell(at) != "" for row in sample for at in values)
        self.has_several, is_table = len(values) > 1, len(values) > len(self.clocks)
        is_filled = 2 * filled >= (len(values) + 1) * len(sample)
        self.is_whole = self.is_sampled or (is_table and is_filled)
        self.needed = {at for x in self.pairs for at in (x.clock.at, x.value.at, *x[-2:])}
        rest = (column for column in columns if column.role not in {"index", "coarse"})
        self.unused = ", ".join(column.name for column in rest if column.at not in self.needed)
        runs = [clock.run for clock in self.clocks]
        file.is_sampled |= self.is_sampled
        file.is_wide |= not self.is_sampled and len(runs) > 1 and not any(runs)
        file.has_runs |= "run" in self.places and not self.is_sampled

    def read(self, rows: Iterator[Row], base: TimeBase) -> Changes:
        """Return the changes that rows say; a row may say that nothing changes, or be unread.

        Parameters
        ----------
        base
            Of samples without times: when the first was taken, and the time between them, s.
        """
        file, self.base, self.count = self.file, base, 0
        self.latest, self.starts = dict[int, int](), dict[tuple[int, int], int]()
        parts: list[list[Any]] = [[] for _ in self.pairs]
        while chunk := list(islice(rows, _CHUNK)):
            filled = enumerate(zip_longest(*(row.texts for row in chunk), fillvalue=""))
            cells = dict.fromkeys(self.needed, [""] * len(chunk)) | dict(filled)
            cells[ROW_COUNT.at] = [str(self.count + n) for n in range(len(chunk))]
            times = {clock.at: self._read_times(chunk, clock, cells) for clock in self.clocks}
            is_read = np.zeros(len(chunk), dtype=bool)
            for pair, part in zip(self.pairs, parts, strict=True):
                ticks, is_said = times[pair.clock.at]
                if self.has_several and pair.value.role != "moment":
                    is_said = is_said & [word != "" for word in cells[pair.value.at]]
                is_read |= is_said
                part.append(self._read_values(chunk, pair, cells, ticks, is_said))
            file.unread += [row.line for row in compress(chunk, ~is_read)]
            self.count += len(chunk)
            changed = sum(len(x) for part in parts for x in part if x.dtype == CHANGE)
            if changed > MAX_EVENTS:
                file.problems.refuse(chunk[-1].line, 1, "too_many_events", limit=MAX_EVENTS)
        file.rows += self.count
        signals = [np.concatenate(part) for part in parts]
        if "volts" in self.places:
            signals = [self._find_crossings(*x) for x in zip(self.pairs, signals, strict=True)]
        else:
            signals = [self._mark_firsts(self._without_same(changes)) for changes in signals]
        silent = self.count - len({line for x in signals for line in x["line"].tolist()})
        if self.is_sampled and 2 * silent > self.count:
            lasting = max(self.latest.values()) - min(self.starts.values())
            file.period = lasting // max(1, self.count - 1)
        return np.concatenate(signals)

    def _read_times(self, rows: list[Row], clock: TimerColumn, cells: Cells) -> tuple[Any, Flags]:
        """Return the times of rows, ps, and which of them say one."""
        at, problems, ticks = clock.at, self.file.problems, list[int]()
        # Of another input's row nothing is said; telephones fill up with zeros.
        is_padded = clock.numbered and clock is not self.clocks[0]
        is_said = np.zeros(len(rows), dtype=bool)
        for n, (row, text) in enumerate(zip(rows, cells[at], strict=True)):
            tick = moment(text, clock.power or 0)
            if text and tick is None:
                self._reject(row, clock)
            ticks.append(tick or 0)
            if tick is None or (tick == 0 and is_padded):
                continue
            if clock.role != "time":
                tick = round(self.base[0] * TICK_HZ + self.base[1] * tick)
            latest = self.latest.get(at, tick)
            if clock.wrap:
                tick += clock.wrap * max(0, round((latest - tick) / clock.wrap))
            lasting_s = abs(tick - self.starts.setdefault((at, row.block.number), tick)) / TICK_HZ
            if self.is_sampled and tick < latest:
                problems.add(*row.place(at), "time", "backwards", text=text)
            if clock.power is not None and lasting_s > LONGEST_S:
                limit = {"recording": "a block", "lasting_s": lasting_s, "limit_s": LONGEST_S}
                problems.add(*row.place(at), clock.role, "too_long", **limit)
            self.latest[at] = ticks[n] = tick
            is_said[n] = True
        return np.array(ticks, dtype=object), is_said

    def _read_values(
        self, rows: list[Row], pair: ColumnPair, cells: Cells, ticks: Any, is_said: Flags
    ) -> Any:
        """Return what a column says: line, time and volts of its samples, or states."""
        names, words = self.file.names, cells[pair.value.at]
        meanings = {x: code_of(pair.value.role, x or pair.value.state) for x in {*words}}
        codes = np.array([meanings[word] for word in words])
        for row in compress(rows, is_said & (codes == _REJECTED)):
            self._reject(row, pair.value)
        lines = np.array([row.line for row in rows])
        if pair.value.role == "volts":
            is_said = is_said & (codes == _VOLTS)
            offsets = ticks[is_said] - min(self.starts.values(), default=0)
            volts = [float(word) for word in compress(words, is_said)]
            return np.array([lines[is_said], offsets, volts], dtype=float).T
        if self.is_sampled:
            is_said = is_said & (codes != _SILENT)
        changes = np.zeros(len(rows), CHANGE)
        changes["line"], changes["tick"], changes["state"] = lines, ticks, codes
        changes["clock"] = 0 if pair.clock.numbered or pair.label else pair.clock.at
        changes["block"] = [row.block.number for row in rows]
        runs = (text or pair.run for text in cells[pair.run_at])
        changes["run"] = [names.setdefault(run, len(names)) for run in runs]
        gates = zip(cells[pair.gate_at], rows, strict=True)
        labels = (text or pair.label or row.block.gate for text, row in gates)
        changes["label"] = [names.setdefault(label, len(names)) for label in labels]
        return self._without_same(changes[is_said])

    def _without_same(self, changes: Changes) -> Changes:
        """Leave out what each row says again, if each says all."""
        is_new = np.full(len(changes), fill_value=not self.is_whole)
        is_new[:1] = True
        for name in "state", "run", "block":
            is_new[1:] |= changes[name][1:] != changes[name][:-1]
        selected: Changes = changes[is_new]
        return selected

    def _mark_firsts(self, changes: Changes) -> Changes:
        """Mark what may be the state at the beginning of a run, and no change."""
        block, count = changes["block"].astype(np.intp), len(self.file.names)
        key = (block * count + changes["run"]) * count + changes["label"]
        _, firsts = np.unique(key, return_index=True)
        is_clear = changes["state"][firsts] == STATES.index("clear")
        changes["first"][firsts] = self.is_whole | is_clear & (changes["tick"][firsts] == 0)
        return changes

    def _find_crossings(self, pair: ColumnPair, samples: Array) -> Changes:
        """Return where volts cross the middle; note how many do, or that nothing passes."""
        volts = samples[:, 2]
        if (threshold := find_threshold(volts)) is None:
            limits = {"low": min(volts, default=0), "high": max(volts, default=0)}
            self.file.notes.append(make_reason("no_passage", input=pair.label, **limits))
            return np.empty(0, CHANGE)
        lines, offsets, is_high = find_crossings(samples, threshold).T
        counts = {"crossings": len(lines), "level": threshold[0]}
        self.file.notes.append(make_reason("crossings", input=pair.label, **counts))
        changes = np.zeros(len(lines), CHANGE)
        changes["line"], changes["state"] = lines, STATES.index("low") + is_high
        start = min(self.starts.values())
        changes["tick"] = [start + round(offset) for offset in offsets.tolist()]
        changes["label"] = self.file.names.setdefault(pair.label, len(self.file.names))
        return changes

    def _reject(self, row: Row, column: TimerColumn) -> None:
        """Note a cell whose value is not accepted."""
        accepted = roles()[column.role][1]
        place = row.place(column.at)
        self.file.problems.reject(*place, column.role, row.cell(column.at), accepted)


@lru_cache(10_000)
def code_of(role: str, word: str) -> int:
    """Return what a word means in such a column, as a place in `STATES` or one behind them."""
    if role == "volts" and is_number(word):
        return _VOLTS
    state, accepted = state_of(word), roles()[role][-1].split()
    if state in {"unknown", "missing"} and role in {*SAMPLED, "moment"}:
        return _SILENT
    state = dict(zip(("zero", "one"), accepted, strict=False)).get(state, state)
    return STATES.index(state) if state in accepted else _REJECTED
