"""Rows of a table as changes: what each column says at a time, and when that changes.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps) and oscilloscopes (volts) are all
the same thing: at a time, an input had a value.
"""

import itertools
import re
from array import array
from collections.abc import Iterable
from contextlib import closing
from functools import lru_cache
from typing import Any

import numpy as np

from rig.arrays import Array
from rig.reasons import make_reason
from rig.timers.columns import SAMPLED, TimerColumn, columns_of, pair_columns, roles
from rig.timers.crossings import find_crossings
from rig.timers.lines import is_cut, read_lines
from rig.timers.moments import HALF_DAY, OVERFLOWS, TICK_HZ, moment
from rig.timers.table import Row, RowBlock, Table
from rig.timers.timer_file import CHANGE, STATES, Records, TimerFile
from rig.timers.vcd import BEGINNINGS, vcd_rows
from rig.timers.vocabulary import facts_held, is_number, kinds_of, state_of

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
_SAMPLE = 200
"""Rows that show what columns are."""
_MARKS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "blanks", "": "words"}
_BEYOND = {"above": np.inf, "below": -np.inf}
"""Volts that are out of an instrument's range."""
_SPARSE = 0.5
"""Share of cells with a text below which the others belong to the one above."""


def read_file(file: TimerFile) -> TimerFile:
    """Find out what a file says, in the way in which its columns are to be understood.

    Raises
    ------
    InputError
        Every fault of the file at its line and column, or what it is instead.
    """
    readers, changes = dict[object, SignalReader](), [np.empty(0, CHANGE)]
    with closing(read_lines(file.path)) as lines:
        head = list(itertools.islice(lines, 50))
        numbered = enumerate(itertools.chain(head, lines), 1)
        is_dump = "".join(head).lstrip().startswith(BEGINNINGS)
        table = Table(vcd_rows(numbered, file.problems) if is_dump else numbered, file.choose)
        file.lines += [f"a table, its cells separated by {_MARKS[table.separator]}"]
        for block, group in itertools.groupby(table.rows(), lambda row: row.block):
            rows = iter(group)
            sample = [*itertools.islice(rows, _SAMPLE)]
            key = block.width, *(tuple(row.texts) for row in block.headings)
            if key not in readers:
                readers[key] = SignalReader(file, block, sample)
            changes.append(readers[key].read(block, itertools.chain(sample, rows)))
    file.problems.raise_if_any()
    file.changes = np.concatenate(changes).view(np.recarray)
    # Below the last row text may stand.
    table.strays += [number for number in table.words if number < file.last_row]
    file.rows += len(table.strays)
    file.unread += table.strays
    if not len(file.changes):
        code = "nothing_passes" if file.rows else "no_edges"
        file.problems.refuse(1, code, notes="".join(f"; {note}" for note in file.notes))
    file.notes += [make_reason("last_line_cut")] if is_cut(file.path) else []
    return file


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

    def __init__(self, file: TimerFile, block: RowBlock, sample: list[Row]) -> None:
        columns = columns_of(file, block, sample)
        self.file, self.known = file, {column.at for column in columns}
        self.clocks = pair_columns(columns)
        self.signals = [*itertools.chain(*self.clocks.values())]
        self.base, self.latest = block.find_time_base(), dict[TimerColumn, int]()
        self.above = dict[str, str]()
        if next(iter(self.clocks)).role != "time" and not self.base[1]:
            durations = ", ".join(repr(x.name) for x in columns if x.role == "duration")
            values = {"numbers": durations, "lacks": "a column of times (s, ms, µs, ns) or a rate"}
            line = (block.headings or sample)[0].line
            file.problems.refuse(line, "durations" if durations else "no_rate", **values)
        used = {column.role: column for column in reversed(columns)}
        is_filled = 2 * sum(signal.filled for signal in self.signals) > len(self.signals)
        self.places = {x: used[x] for x in ("run", "gate") if x in used and "volts" not in used}
        self.is_sampled = "volts" in used or ("level" in used and is_filled)
        self.is_whole = is_filled and (self.is_sampled or len(self.signals) > len(self.clocks))
        needed = {*self.places.values(), *self.clocks, *self.signals}
        unused = ", ".join(x.name for x in columns if x.role != "index" and x not in needed)
        file.notes += [make_reason("columns_unused", columns=unused)] if unused else []
        file.lines += [f"  {column}" for column in columns]
        called = {re.sub("^column|[0-9]+", "", x.name).strip() for x in self.clocks if not x.run}
        held = {
            "wide": len(self.clocks) > len(called - {""}) == 1 and not self.is_sampled,
            "guess": any(x.filled <= _SPARSE for x in self.places.values()),
            "sampled": self.is_sampled,
        }
        file.facts |= {*self.places, *facts_held(held)}

    def read(self, block: RowBlock, rows: Iterable[Row]) -> Records:
        """Return the changes that rows say; a row may say that nothing changes, or be unread."""
        file, self.block, self.count, self.steps = self.file, block, 0, array("d")
        self.starts, self.states = dict[int, int](), dict[Any, tuple[str, str]]()
        self.changes = list[Any]()
        self.samples = {x: array("d") for x in self.signals if x.role == "volts"}
        for row in rows:
            for role, column in self.places.items():
                # Of merged cells only the first has a text.
                if (text := row.cell(column.at)) or column.filled > _SPARSE:
                    self.above[role] = text
            is_read = {
                True in {self._read_value(row, tick, signal) for signal in signals}
                for clock, signals in self.clocks.items()
                if (tick := self._read_time(row, clock)) is not None
            }
            rest = [x for n, x in enumerate(row.texts) if x and n not in self.known]
            if is_read != {True} or any(map(kinds_of, rest)):  # words may stand behind
                file.unread.append(row.line)
            if len(self.changes) > MAX_EVENTS:
                file.problems.refuse(row.line, "too_many_events", limit=MAX_EVENTS)
            self.count += 1
        file.rows += self.count
        file.last_row = row.line
        for signal, samples in self.samples.items():
            self._find_crossings(signal, np.array(samples).reshape(-1, 3))
        if self.is_sampled and 2 * len({change[0] for change in self.changes}) < len(self.steps):
            file.period = int(np.median(self.steps))  # between drops there may be pauses
        return np.array(self.changes, CHANGE)

    def _read_time(self, row: Row, clock: TimerColumn) -> int | None:
        """Return the time of a row, ps; `None` where it says nothing.

        Rows of samples without times are at a stated rate.
        """
        text = row.cell(clock.at)
        tick = self.count * TICK_HZ if clock.at < 0 else moment(text, clock.power or 0)
        if tick is None:
            if text:
                self._reject(row, clock, text)
            return None
        if clock.role != "time":
            tick = round(self.base[0] * TICK_HZ + self.base[1] * tick)
        latest = self.latest.get(clock, tick)  # of the block above, too: a counter goes on
        if tick < latest:
            counters = [n * 10 ** (12 - (clock.power or 0)) for n in OVERFLOWS]
            for wrap in [HALF_DAY] if ":" in text else counters:
                pause = (tick - latest) % wrap
                tick = latest + pause if 8 * pause < wrap else tick
        if self.is_sampled and tick < latest and clock.at in self.starts and not self.places:
            self.file.problems.add(*row.place(clock.at), "time", "backwards", text=text)
        self.starts.setdefault(clock.at, tick)
        self.latest[clock] = tick
        self.steps.append(tick - latest)
        return tick

    def _read_value(self, row: Row, tick: int, signal: TimerColumn) -> bool:
        """Keep what a cell says: a sample of volts, or a state if that is a change."""
        word = signal.word(row.cell(signal.at))
        if not (word or self.is_sampled or signal.role == "moment"):
            return False
        key = signal, *self.above.values()
        before, text = self.states.get(key, (None, None))
        if self.is_whole and word == text:  # in nearly all rows of levels
            return True
        state = meaning_of(signal.role, word)
        if state is None:
            self._reject(row, signal, word)
        elif isinstance(state, float):
            self.samples[signal].extend((row.line, tick - self.starts[signal.clock], state))
        elif state or signal.role == "moment":
            self.states[key] = state, word
            if not self.is_whole or before != state:
                self._add_change(signal, row.line, tick, state, self.is_whole and before is None)
        return True

    def _add_change(
        self, signal: TimerColumn, line: int, tick: int, state: str, is_first: bool = False
    ) -> None:
        """Keep a change, or what may be the state at the beginning of a run.

        Its run and input are named in the row, in its heading, or in a mark above.
        """
        run = self.above.get("run") or signal.run or self.block.run
        gate = self.above.get("gate") or signal.label or self.block.gate
        place = self.file.names[run], self.file.names[gate], signal.clock, self.block.number
        self.changes.append((line, tick, STATES.index(state), *place, is_first))

    def _find_crossings(self, signal: TimerColumn, samples: Array) -> None:
        """Keep where volts cross the middle; note how many do, or that nothing passes."""
        level, crossings = find_crossings(samples)
        code, values = "crossings", {"crossings": len(crossings), "level": level}
        if not len(samples):
            code, values = "no_samples", {}
        elif level is None:
            code, values = "no_passage", {"low": min(samples[:, 2]), "high": max(samples[:, 2])}
        self.file.notes.append(make_reason(code, input=signal.label, **values))
        # A last value may be cut off.
        for line, offset, is_high in crossings[crossings[:, 0] < self.file.last_row].tolist():
            tick = self.starts[signal.clock] + round(offset)
            self._add_change(signal, int(line), tick, "high" if is_high else "low")

    def _reject(self, row: Row, column: TimerColumn, text: str) -> None:
        """Note a cell whose value is not accepted."""
        accepted = roles()[column.role][1]
        self.file.problems.reject(*row.place(column.at), column.role, text, accepted)


@lru_cache(10_000)
def meaning_of(role: str, word: str) -> str | float | None:
    """Return what a word means in such a column; `None` if it is not accepted.

    Returns
    -------
    str or float
        One of `STATES`, or volts, infinite beyond an instrument's range.
    """
    state, accepted = state_of(word), roles()[role][-1].split()
    if role == "volts" and (is_number(word) or state in _BEYOND):
        return _BEYOND.get(state) or float(word)
    if state == "unknown" or (state in {"undefined", "missing"} and role in {*SAMPLED, "moment"}):
        return ""
    state = dict(zip(("zero", "one"), accepted, strict=False)).get(state, state)
    return state if state in accepted else None
