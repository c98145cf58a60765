"""Rows of passages as events: when, at which input, and what the beam or signal did."""

from __future__ import annotations

import sys
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from rig.timers.columns import Signal, TimerColumn, roles
from rig.timers.moments import TICK_HZ, moment, picoseconds
from rig.timers.vocabulary import state_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rig.timers.problems import ProblemList
    from rig.timers.table import Row

    PartKey = tuple[str, int]

MAX_EVENTS = 500_000
"""Those of 600 drops of 25 rods past 16 gates; what has more is no record of drops."""
LONGEST_S = 86400
"""How long a recording may be: more means a wrong unit."""


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


class EventList:
    """Events of a block, those of a run together.

    Attributes
    ----------
    by_part
        Events by their run, as the file calls it, and by their column of times where nothing else
        tells its times from those of another.
    rows
        How many lines of data there were.
    unread
        Those that neither change anything nor say that nothing changes.
    """

    def __init__(self, problems: ProblemList) -> None:
        self.problems = problems
        self.by_part: dict[PartKey, list[TimerEvent]] = {}
        self.rows, self.unread, self._count = 0, list[int](), 0

    def put(self, run: str, at: int, event: TimerEvent) -> list[TimerEvent]:
        """Add an event of a run, or of the column of times at a place; return its part."""
        part = self.by_part.setdefault((run, at), [])
        part.append(event)
        self._count += 1
        if self._count > MAX_EVENTS:
            self.problems.refuse(event.line, 1, "too_many_events", limit=MAX_EVENTS)
        return part

    def reject(self, row: Row, column: TimerColumn) -> None:
        """Note a cell whose value is not accepted."""
        text = row.texts[column.at] if column.at < len(row.texts) else ""
        self.problems.reject(*row.place(column.at), column.role, text, roles()[column.role][1])


def read_passages(
    columns: Sequence[TimerColumn], signals: Sequence[Signal], rows: Iterable[Row], out: EventList
) -> None:
    """Read rows; each gives events, or says that nothing changes, or is unread."""
    run_at, gate_at = (
        next((c.at for c in columns if c.role == role), sys.maxsize) for role in ("run", "gate")
    )
    has_several = len(signals) > 1 and any(signal.value for signal in signals)
    last: dict[tuple[str, str], str] = {}
    for row in rows:
        out.rows += 1
        run, label = row.cell(run_at), row.cell(gate_at)
        passages = list(_passages(row, signals, has_several))
        is_whole = has_several and len(passages) == len(signals)
        for signal, tick, state in passages:
            if tick is None or state is None:
                out.reject(row, signal.value if state is None and signal.value else signal.clock)
                continue
            key = run or signal.run, label or signal.label
            # Where each row has the states of all inputs, most of them are as they were.
            before = last.get(key, "clear" if is_whole or not tick else None)
            is_same = state == before and (is_whole or key not in last)
            if not is_same:
                last[key] = state
                event = TimerEvent(tick, key[1], state, row.line)
                part = out.put(key[0], 0 if any(key) else signal.clock.at, event)
                lasting_s = abs(tick - part[0].tick) / TICK_HZ
                if signal.clock.power is not None and lasting_s > LONGEST_S:
                    place = *row.place(signal.clock.at), signal.clock.role
                    values = {"lasting_s": lasting_s, "limit_s": LONGEST_S}
                    out.problems.add(*place, "too_long", recording="the recording", **values)
        if not passages:
            out.unread.append(row.line)


def _passages(
    row: Row, signals: Sequence[Signal], has_several: bool
) -> Iterator[tuple[Signal, int | None, str | None]]:
    """Yield what a row says of each input: a time and a state, `None` if not accepted."""
    for n, signal in enumerate(signals):
        clock, value = signal.clock, signal.value
        text, word = row.cell(clock.at), row.cell(value.at) if value else ""
        # Of another input's row nothing is said; telephones fill up with zeros.
        is_filler = n and clock.numbered and not picoseconds(text)
        if text and not is_filler and (word or not (value and has_several)):
            state = state_in(value.role, word) if value else clock.state
            yield signal, moment(text, clock.power or 0), state


@lru_cache(1000)
def state_in(role: str, word: str) -> str | None:
    """Return what a word means in a column of that role; `None` if it is no state there."""
    accepted, state = roles()[role][-1].split(), state_of(word)
    state = dict(zip(("zero", "one"), accepted, strict=False)).get(state, state)
    return state if state in accepted else None
