"""Rows of a timer's table as events: when, at which input, and what the beam or signal did."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import date
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from rig.boards import GATES
from rig.timers.table import HEADER
from rig.timers.vocabulary import CLOCK, number_of, state_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rig.timers.columns import TimerColumn
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row

TICK_HZ = 10**12
MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
_LISTED = 100
"""Lines that are named, at most."""
_DAY_S, _HOUR_S = 86400, 3600
"""How long a recording may be, and a run: an hour in a run means a wrong unit or a wrong run."""
_DECIMAL = re.compile(r"([+-]?)([0-9]{0,30})(?:\.([0-9]{0,60}))?(?:[eE]([+-]?[0-9]{1,2}))?")
_OWN = {
    "run": (re.compile("[+]?0*[1-9][0-9]{0,8}"), "a run: a whole number from 1"),
    "gate": (re.compile("|".join(map(str, range(GATES)))), f"a channel: 0 to {GATES - 1}"),
    "time": (re.compile(r"(?=.*[0-9])" + _DECIMAL.pattern), "a time of a drop in seconds"),
    "state": (re.compile("[01]"), "a state: 1 is blocked, 0 is clear"),
}
"""What the project's own format accepts."""
_STATES = {
    "state": (
        {"blocked": "blocked", "one": "blocked", "clear": "clear", "zero": "clear"},
        "a state: 1 or blocked, 0 or unblocked",
    ),
    "edge": (
        {"high": "high", "one": "high", "low": "low", "zero": "low"},
        "an edge: rising or falling",
    ),
}
"""What a word means in a column of states, or of edges of a signal, and what is accepted there."""


class TimerEvent(NamedTuple):
    """One change at one input.

    Attributes
    ----------
    tick
        In picoseconds.
    label
        What the file calls the input; empty where it does not say.
    state
        What begins with it: ``blocked`` or ``clear``; ``high`` or ``low`` where only the signal is
        known; empty where the file does not say.
    line
        Of the file.
    """

    tick: int
    label: str
    state: str = ""
    line: int = 0


@dataclass(slots=True)
class FilePart:
    """Events that stand together: those of a run, or of a gate.

    Attributes
    ----------
    name
        What the file calls it; empty where nothing is said.
    number
        Of the run, where the file says it; else 0.
    """

    name: str = ""
    number: int = 0
    events: list[TimerEvent] = field(default_factory=list)


class _Stream(NamedTuple):
    """A column of times with the column that says what they did; of an input, and of a run."""

    time: TimerColumn
    state: TimerColumn | None
    label: str
    run: str


def _streams_of(columns: Sequence[TimerColumn]) -> Iterator[_Stream]:
    """Give each column of times the states that belong to it: of its run, and of its input."""
    times = [column for column in columns if column.role == "time"]
    every = [[c for c in columns if c.role == role] for role in ("state", "edge")]
    for time in times:
        beside = [other for other in times if other.run == time.run]
        states = [c for c in every[0] or every[1] if c.run in {time.run, ""} or not time.run]
        if len(beside) > 1:
            like = [state for state in states if time.gate and state.gate == time.gate]
            nearest = [min(beside, key=lambda t: (t.at > s.at, abs(t.at - s.at))) for s in states]
            own = [s for s, near in zip(states, nearest, strict=True) if near is time]
            states = like or own[-1:]
        if len(states) > 1:
            for each in states:
                yield _Stream(time, each, each.gate or each.name, time.run or each.run)
        else:
            state = states[0] if states else None
            label = time.gate or (state.gate if state and len(beside) > 1 else "")
            is_plain = state is None and time.blocked is None and not time.run
            is_named = is_plain and label and label in time.name
            yield _Stream(time, state, time.name if is_named else label, time.run)


class RowReader:
    """Reads rows of events, run by run.

    Parameters
    ----------
    columns
        What each column is.
    sample
        The first rows, which tell whether a row is a run.
    is_own
        Whether the rows are of the project's own format.

    Attributes
    ----------
    parts
        What was read, by run.
    rows, silent
        How many rows there are, and how many of them only say that nothing changes.
    unread
        Lines of the first rows that say neither.
    has_runs
        Whether the file says of which run a row is, or each row is a run.
    """

    def __init__(
        self,
        columns: Sequence[TimerColumn],
        sample: Sequence[Row],
        problems: ProblemList,
        *,
        is_own: bool,
    ) -> None:
        self.parts: dict[object, FilePart] = {}
        self.rows = self.silent = self._events = 0
        self.unread: list[int] = []
        self._columns = {column.role: column for column in columns}
        self._streams = list(_streams_of(columns))
        self._is_own, self._problems = is_own, problems
        self._last: dict[tuple[int, str], TimerEvent] = {}
        self._states: dict[tuple[int, str], str] = {}
        self._several = len(self._streams) > 1 and any(s.state for s in self._streams)
        self._row_is_run = self._is_row_a_run(sample)
        self.has_runs = self._row_is_run or "run" in self._columns

    def read(self, rows: Iterable[Row]) -> None:
        """Read rows; each gives events, or says that nothing changes, or is unread."""
        for row in rows:
            before, silent = self._events, self.silent
            if not self._is_own or self._is_own_row(row):
                self._read_row(row)
            self.rows += 1
            if self._events > before:
                self.silent = silent
            elif self.silent > silent:
                self.silent = silent + 1
            else:
                self.unread += [row.line] * (len(self.unread) < _LISTED)
            if self._events > MAX_EVENTS:
                self._problems.refuse(row.line, 1, "too_many_events", limit=MAX_EVENTS)

    def _is_row_a_run(self, sample: Sequence[Row]) -> bool:
        """Whether times that stand side by side are one drop: a row each, gate after gate."""
        times = [stream.time for stream in self._streams]
        if len(times) < 2 or {"gate", "edge"} & set(self._columns) or self._several:
            return False
        if any(t.run or not (t.gate or t.numbered or t.blocked is not None) for t in times):
            return False
        if len(sample) == 1 or "run" in self._columns:
            return True
        firsts = [picoseconds(text) or 0 for row in sample if (text := row.cell(times[0].at))]
        return any(t.numbered and not t.gate for t in times) or firsts != sorted(firsts)

    def _is_own_row(self, row: Row) -> bool:
        """Whether a row of the project's own format has four values, each as accepted."""
        if row.raw.count('"') % 2:
            self._problems.add(row.line, 1, "", "open_quote")
            return False
        if len(row.texts) != len(_OWN):
            values = {"values": len(row.texts), "needed": len(_OWN), "header": ",".join(HEADER)}
            self._problems.add(row.line, 1, "", "wrong_width", **values)
            return False
        cells = zip(_OWN.items(), row.texts, strict=True)
        wrong = [role for (role, (accepted, _)), text in cells if not accepted.fullmatch(text)]
        for role in wrong:
            self._reject(row, self._columns[role], _OWN[role][1])
        return not wrong

    def _read_row(self, row: Row) -> None:
        run, gate = self._columns.get("run"), self._columns.get("gate")
        number = number_of(row.cell(run.at)) if run else 0
        if run and number is None:
            self._reject(row, run, "a whole number")
        for stream in self._streams:
            text, at = row.cell(stream.time.at), stream.time.at
            nothing = self._row_is_run and stream is not self._streams[0] and not picoseconds(text)
            if not text or nothing:
                continue
            label = row.cell(gate.at) if gate else stream.label
            key: tuple[object, ...] = (number, stream.run)
            if self._row_is_run:
                key, name = (number, row.line), stream.time.name
                label = label or (name if stream.time.numbered and name[:1] in "tTZ" else "")
            elif not label and not stream.run:
                key = (number, at)
            part = FilePart(stream.run, number or number_of(stream.run) or 0)
            self._add(row, stream, text, label, self.parts.setdefault(key, part))

    def _add(self, row: Row, stream: _Stream, text: str, label: str, part: FilePart) -> None:
        column, key = stream.time, (id(part), label)
        time = moment(text, column.power or 0)
        state = "" if column.blocked is None else "blocked" if column.blocked else "clear"
        if time is None or abs(time) >= 10**24:
            self._reject(row, column, "a time that a drop can have")
            return
        if stream.state is not None:
            word = row.cell(stream.state.at)
            if self._several and not word:
                return  # another input's row
            states, accepted = _STATES[stream.state.role]
            state = states.get(state_of(word), "")
            if not state:
                self._reject(row, stream.state, accepted)
                return
            # Where each row has the states of all inputs, most of them are as they were.
            whole = self._several and all(
                row.cell(s.state.at) for s in self._streams if s.state and s.run == stream.run
            )
            begins = not part.events and state == "clear" and time == 0 and not self._is_own
            if (whole and self._states.get(key, "clear") == state) or begins:
                self.silent += 1
                return
            self._states[key] = state
        event = TimerEvent(time, label, state, row.line)
        if self._is_in_time(row, column, event, part, self._last.get(key, event)):
            self._last[key] = event
            part.events.append(event)
            self._events += 1

    def _is_in_time(
        self, row: Row, column: TimerColumn, event: TimerEvent, part: FilePart, last: TimerEvent
    ) -> bool:
        """Whether a time can be of its run; within a numbered one, those of an input go on."""
        code, values = "", dict[str, object]()
        lasting_s = abs(event.tick - part.events[0].tick) / TICK_HZ if part.events else 0.0
        limit_s, recording = _DAY_S, "the recording"
        if self._is_own:
            limit_s, recording = _HOUR_S, f"run {part.number}"
        if column.power is not None and lasting_s > limit_s:
            code = "too_long"
            values = {"recording": recording, "lasting_s": lasting_s, "limit_s": limit_s}
        elif event.tick < last.tick and self.has_runs and not self._row_is_run:
            code = "before_last"
            values = {"last": seconds(last.tick, Fraction(TICK_HZ)), "text": row.cell(column.at)}
            values |= {"channel": event.label, "run": part.number}
        if code:
            key = column.name if self._is_own else column.role
            self._problems.add(row.line, row.column(column.at), key, code, **values)
        return not code

    def _reject(self, row: Row, column: TimerColumn, accepted: str) -> None:
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        key = column.name if self._is_own else column.role
        self._problems.reject(row.line, row.column(column.at), key, text, accepted)


def moment(text: str, power: int) -> int | None:
    """Read a time as picoseconds: a number, or a date with its time of day."""
    match = CLOCK.fullmatch(text) if ":" in text else None
    if match is None:
        return picoseconds(text, -power)
    first, mark, second, third, hours, minutes, rest = match.groups()
    day, ticks = 0, picoseconds(rest.replace(",", ".")) or 0
    if first:
        # Only how many days lie between two times matters: which part is the year is enough.
        parts = [int(first), int(second), int(third)]
        year, month, of_month = parts if len(first) > 2 else parts[::-1]
        if mark == "/" and parts[0] <= 12:
            month, of_month = parts[0], parts[1]
        try:
            day = date(year, month, of_month).toordinal()
        except ValueError:
            return None
    return ((day * 24 + int(hours or 0)) * 60 + int(minutes)) * 60 * TICK_HZ + ticks


def picoseconds(text: str, power: int = 0) -> int | None:
    """Read a decimal number of seconds, or of 10^power s, as picoseconds, ties to even.

    Returns
    -------
    int or None
        `None` for what is no such number.
    """
    match = _DECIMAL.fullmatch(text)
    if match is None or not (match[2] or match[3]):
        return None
    sign, integer, part, exponent = match.groups(default="")
    digits, shift = int(integer + part), int(exponent or 0) - len(part) + 12 + power
    ticks = digits * 10**shift if shift >= 0 else round(Fraction(digits, 10**-shift))
    return -ticks if sign == "-" else ticks


def seconds(tick: int, rate: Fraction) -> str:
    """Write a time as a plain decimal, exact to the picosecond."""
    # In whole numbers: dividing Fractions costs ten times as much.
    ticks, ratio = 2 * tick * TICK_HZ * rate.denominator, rate.numerator
    rounded = (ticks + ratio) // (2 * ratio)
    integer, part = divmod(abs(rounded), TICK_HZ)
    sign = "-" if rounded < 0 else ""
    return f"{sign}{integer}.{part:012d}".rstrip("0").rstrip(".")


def split_at_jumps(part: FilePart, *, in_order: bool) -> list[FilePart]:
    """Divide what stands one below the other where the times of an input do not go on.

    Parameters
    ----------
    in_order
        Whether each row has a single time, so that a time before any above it begins anew; gates
        may stand one after the other all the same.
    """
    parts, last = [FilePart(part.name, part.number)], dict[str, int]()
    for event in part.events:
        latest = max(last.values(), default=0) if in_order else last.get(event.label, 0)
        if event.label in last and event.tick < latest:
            parts.append(FilePart(part.name))
            last = {}
        last[event.label] = event.tick
        parts[-1].events.append(event)
    return parts


def widest_pause(ticks: Sequence[int]) -> int:
    """Return the pause, ps, at which drops one after the other are parted; 0 where there is none.

    Between drops nothing passes for far longer than ever within one: the pauses in order, the
    widest step from one to the next, by a factor of 3 at least, up to half a second or more.
    """
    pauses = sorted(b - a for a, b in pairwise(ticks))
    steps = [(b / max(a, TICK_HZ // 1000), b) for a, b in pairwise(pauses) if 2 * b >= TICK_HZ]
    ratio, pause = max(steps, default=(0.0, 0))
    return pause if ratio >= 3.0 else 0
