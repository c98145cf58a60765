"""Exports of other timers: a column of times, or times and states, as data loggers write them.

Vernier's and PASCO's programs export tables with a heading, one pair of columns a run; the
separator is a comma, a semicolon or a tab, and where the computer is set up so, decimals have a
comma. What such a table does not say (which beam it was) is asked of the caller.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rig.records import Edge
from rig.session.csv_lines import ProblemList
from rig.session.edges_csv import MAX_SPAN_S, TICK_HZ, drop_of, picoseconds
from rig.session.timer_table import (
    BLOCKED,
    CLEAR,
    NUMBER,
    STATE,
    TIME,
    Row,
    TableCell,
    cells_of,
    has_number,
    heading_of,
    is_data,
    lines_of,
    separator_of,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from rig.records import Drop

MAX_COLUMNS = 200
_UNIT = re.compile(r"[\[(]\s*([a-zµμ]+)\s*[\])]\s*(?:run.*)?$", re.IGNORECASE)
_UNITS = {"s": 0, "sec": 0, "seconds": 0, "ms": 3, "us": 6, "µs": 6, "μs": 6}


@dataclass(slots=True)
class _Column:
    """One run: where its times are, where its states, and what was read so far."""

    times: int
    states: int | None
    power: int
    rows: list[tuple[int, bool | None]] = field(default_factory=list)


def read_timer(path: str | os.PathLike[str], channel: int, bars: int) -> list[Drop]:
    """Read the runs of a data logger's export.

    Parameters
    ----------
    path
        The file.
    channel
        Of the beam that the times are of.
    bars
        How many bars pass it: with no states given, more times than that are of darkening and
        clearing in turn, and as many or fewer of darkening alone.

    Returns
    -------
    list of Drop
        One a run, numbered from 1 in the order of the columns; as
        `rig.session.edges_csv.read_edges` gives them.

    Raises
    ------
    InputError
        Every fault of the file at its line and column.
    """
    problems = ProblemList(str(path))
    lines = lines_of(path)
    separator = separator_of(lines)
    table = [(number, cells_of(line, separator)) for number, line in enumerate(lines, 1)]
    table = [(number, cells) for number, cells in table if any(cell.text for cell in cells)]
    first = next((n for n, (_, cells) in enumerate(table) if is_data(cells, separator)), None)
    if first is None:
        problems.add(1, 1, "", "no row of numbers: times are wanted, with or without states")
        problems.raise_if_any(_HINT)
        return []
    # A row with a number below the heading is one of data, if a faulty one.
    heading = heading_of(table[:first])
    begin = 0 if heading is None else table.index(heading) + 1
    numbered = (n for n in range(begin, first) if has_number(table[n][1], separator))
    first = next(numbered, first)
    columns = _columns(table[:first], table[first], problems)
    problems.raise_if_any(_HINT)
    for number, cells in table[first:]:
        _row(number, cells, columns, separator, problems)
    problems.raise_if_any()
    found = [column for column in columns if column.rows]
    if not found:
        problems.add(table[first][0], 1, "time", "no times below the heading")
        problems.raise_if_any(_HINT)
    return [drop_of(run, _edges(column.rows, channel, bars)) for run, column in enumerate(found, 1)]


_HINT = (
    "accepted are run,channel,time_s,state and tables with a heading such as Time (s) and "
    "GateState, separated by comma, semicolon or tab"
)


def _columns(
    headings: list[Row],
    row: Row,
    problems: ProblemList,
) -> list[_Column]:
    """Find the columns of times and of states by their headings, or by their number."""
    heading = heading_of(headings)
    if heading is not None:
        number, cells = heading
        times = [n for n, cell in enumerate(cells) if TIME.search(cell.text)]
        if len(cells) > MAX_COLUMNS:
            problems.add(number, 1, "", f"{len(cells)} columns; at most {MAX_COLUMNS} are read")
            return []
        found = []
        for n, end in zip(times, [*times[1:], len(cells)], strict=True):
            states = [m for m in range(n + 1, end) if STATE.search(cells[m].text)]
            # Some tables have the state before the time.
            before = [m for m in range(n) if n == times[0] and STATE.search(cells[m].text)]
            state = next(iter([*states, *before]), None)
            found.append(_Column(n, state, _power(number, cells[n], headings, n, problems)))
        return found
    number, cells = row
    if headings:
        last, texts = headings[-1]
        problems.add(last, texts[0].column, "", "no column of this heading is a time")
        return []
    if len(cells) > 2:
        problems.add(
            number,
            cells[2].column,
            "",
            f"{len(cells)} columns without a heading; at most time and state",
        )
        return []
    return [_Column(0, 1 if len(cells) > 1 else None, 0)]


def _power(number: int, cell: TableCell, headings: list[Row], n: int, problems: ProblemList) -> int:
    """Decimal power from the heading's unit to seconds; units may have a line of their own."""
    match = _UNIT.search(cell.text)
    unit = match[1].lower() if match else "s"
    if match is None:
        below = [cells[n].text.lower() for at, cells in headings if at > number and n < len(cells)]
        unit = next((text for text in below if text in _UNITS), "s")
    if unit not in _UNITS:
        problems.add(number, cell.column, "time", f"{unit!r} is no unit of time: s, ms or µs")
        return 0
    return _UNITS[unit]


def _row(
    number: int,
    cells: list[TableCell],
    columns: list[_Column],
    separator: str,
    problems: ProblemList,
) -> None:
    """Read one row's value of every run; runs that ended earlier have blanks."""
    for column in columns:
        cell = cells[column.times] if column.times < len(cells) else TableCell(1, "")
        if not cell.text:
            continue
        text = cell.text if separator == "," else cell.text.replace(",", ".", 1)
        time = picoseconds(text, -column.power)
        if time is None or abs(time) >= 10**12 * TICK_HZ:
            problems.add(
                number, cell.column, "time", f"{cell.text!r:.40} is not a time a drop can have"
            )
            continue
        state: bool | None = None
        if column.states is not None:
            state_cell = cells[column.states] if column.states < len(cells) else TableCell(1, "")
            value = state_cell.text.lower()
            value = value.rstrip("0").rstrip(".,") or "0" if NUMBER.fullmatch(value) else value
            if value not in BLOCKED | CLEAR:
                problems.add(
                    number, state_cell.column, "state",
                    f"{state_cell.text!r:.40} is no state: 1 or blocked, 0 or unblocked",
                )  # fmt: skip
                continue
            state = value in BLOCKED
        before = column.rows[-1][0] if column.rows else time
        if time < before:
            problems.add(number, cell.column, "time", f"{cell.text} is before the time above it")
            continue
        if column.rows and time - column.rows[0][0] > MAX_SPAN_S * TICK_HZ:
            problems.add(number, cell.column, "time", "a run would last more than an hour")
            continue
        column.rows.append((time, state))


def _edges(rows: list[tuple[int, bool | None]], channel: int, bars: int) -> list[Edge]:
    return [Edge(time, channel, blocked) for time, blocked in _told(rows, bars)]


def _told(rows: list[tuple[int, bool | None]], bars: int) -> Iterator[tuple[int, bool]]:
    """Say of each time whether the beam darkened."""
    both = len(rows) > bars
    for n, (time, state) in enumerate(rows):
        yield time, (n % 2 == 0 if both else True) if state is None else state
