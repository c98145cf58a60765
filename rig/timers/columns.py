"""What each column of a timer's table is: by its heading, by its unit, and by its values."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

from rig.timers.table import (
    BLOCKED,
    CLEAR,
    FALLING,
    NAME_AND_NUMBER,
    NO_LEVEL,
    RISING,
    as_state,
    is_number,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.timers.problems import ProblemList
    from rig.timers.table import Row, RowBlock, TableCell

UNITS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sekunden", "secondes", "secondi",
                     "segundos"), 0),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds", "millisekunden"), 3),
    **dict.fromkeys(("us", "µs", "μs", "usec", "micros", "microsecond", "microseconds",
                     "mikrosekunden"), 6),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), 9),
}  # fmt: skip
"""Decimal power from seconds, by what a heading or a row of units says."""

_UNIT = re.compile(r"[\[(]\s*([^\W\d_]+)\s*[\])]|/\s*([^\W\d_]+)\s*$|[_ ]([^\W\d_]+)\s*$")
_RUN = re.compile(r"\brun\s*#?\s*[0-9]+|\bset\s*[0-9]+", re.IGNORECASE)

_I = re.IGNORECASE
_STATE = re.compile(r"state|status|blocked|zustand|[ée]tat|estado|\bstato\b", _I)
_DURATION = re.compile(
    r"interval|period|dur[aeé]|delta|Δ|dauer|differ|\blap\b|\bhalf\b|"
    r"(?:time|zeit|tempo)\s+(?:in|between|btw)|(?:gate|pulse)\s+time", _I)  # fmt: skip
_TIME = re.compile(
    r"(?<![a-z])(?:times?|zeit|zeiten|temps|tiempo|tempo|tempi|tijd|tid|time ?stamps?)(?![a-z])|"
    r"^t$|^t[\s_/(\[0-9]|^(?:micros|millis)\b", _I)  # fmt: skip
_NUMBERED_RUN = re.compile(r"^(?:run|trial|versuch|lauf|drop|prova|essai|set)\b", _I)
_EDGE = re.compile(r"\bedge|flanke|\bkante|transition|slope|polarity|fronte\b|^level$", _I)
_VOLTS = re.compile(
    r"volt|[\[(]\s*(?:m?V|lx)\s*[\])]|spannung|tension|potential|illumin|luminan|\blux\b", _I
)
_SCOPE = re.compile(r"^(?:ch|chan|channel|kanal)[\s_]*[0-9a-d]$", _I)
_MOMENT = re.compile(r"^(?:start|stop|on|off)(?![a-z])\s*[0-9]*", _I)
_NUMBERED = re.compile(r"^(?:t|time|zeit|event)[\s_#]*[0-9]+(?![0-9])", _I)
_DARKENS = re.compile(
    r"(?<![a-z])(?:(un|not )?block(?:ed|s)?|(clear)(?:ed|s)?|dark(?:ens?)?)(?![a-z])", _I
)
_ANY_INPUT = re.compile(
    r"(?:photogate|gate|channel|chan|ch|pin|input|beam|sensor|port|lichtschranke)[\s_#]*[0-9]+", _I
)
_VOLT_WORDS = {"v", "volt", "volts", "mv", "lx"}
_INPUT = re.compile(
    r"^(?:d|ch|chan|channel|digital|pin|gate|input|in|beam|sensor|di|dio|kanal|logic)?"
    r"[\s_#:-]*([0-9]+)$", _I)  # fmt: skip
_CHANNEL = re.compile(
    r"channel|kanal|\bpin\b|(?:photo)?gate|\bbeam|\binput\b|sensor|\bport\b|canale|\bvoie\b|"
    r"lichtschranke|barri[eè]r|fotocellula|\bch\b", _I)  # fmt: skip
_COUNTER = re.compile(r"event|ereignis|index|count|^n$|^nr\b|^no\b|^#$|number|sample|^i$", _I)
_DERIVED = re.compile(
    r"dist|pos|vel|speed|accel|height|angle|weg|strecke|geschwindigkeit|omega|^v[a-z]?$|^a[a-z]?$|"
    r"^[dsxyz]$|^[xyz]\b|latitude|error|note|remark|comment", _I)  # fmt: skip
_WHOLE = re.compile(r"[0-9]{1,4}")
_STATES = (BLOCKED | CLEAR) - RISING - FALLING
_WORTH = 200  # rows that are looked at
_SYMBOLS = {0: "s", 3: "ms", 6: "µs", 9: "ns"}
_MEANINGS = {
    "state": "states, blocked or clear",
    "duration": "durations, not used",
    "time": "times",
    "time of an input": "times",
    "moment": "times",
    "edge": "edges, up or down",
    "volts": "volts, or light",
    "level": "levels of an input",
    "run": "run",
    "channel": "which gate",
    "counter": "counts rows, not used",
    "other": "not used",
}


@dataclass(slots=True)
class TimeColumn:
    """Times of one run, or of all of them.

    Attributes
    ----------
    at
        Which column, from 0.
    power
        Decimal power from seconds.
    state
        The column of states that belongs to it.
    label
        The input that all of them are of; empty where other columns say that.
    blocked
        What all of them did to the beam, where the heading says it.
    """

    at: int
    power: int
    state: int | None = None
    label: str = ""
    blocked: bool | None = None


@dataclass(slots=True)
class Columns:
    """What the columns of a block are; the numbers are columns from 0.

    Attributes
    ----------
    times
        One, or one a run where runs stand side by side.
    edge
        Which way a signal went, which is not yet whether the beam is blocked.
    channel, run
        Which gate and which run a row is of.
    levels
        Samples of inputs, by the name of the input: 0 and 1.
    volts
        Samples in volts, by heading.
    unused
        Headings of all others.
    derived
        Whether places, speeds or other measured things stand beside the times.
    row_is_run
        Whether each row is a drop of its own, its times side by side.
    meanings
        What each column was taken for, in words, by its heading or number.
    """

    times: list[TimeColumn] = field(default_factory=list)
    edge: int | None = None
    channel: int | None = None
    run: int | None = None
    levels: dict[int, str] = field(default_factory=dict)
    volts: dict[int, str] = field(default_factory=dict)
    unused: list[str] = field(default_factory=list)
    derived: bool = False
    row_is_run: bool = False
    meanings: dict[str, str] = field(default_factory=dict)


def columns_of(block: RowBlock, separator: str, unit: str | None, problems: ProblemList) -> Columns:
    """Find out what the columns of a block are.

    Parameters
    ----------
    unit
        Of the times where the file does not say, a key of `UNITS`.
    problems
        Where it is noted, at its place, if that cannot be found out.
    """
    width = max(len(row.cells) for row in block.rows[:_WORTH])
    values = [_values(block, n) for n in range(width)]
    heading = _with_units(block, _find_heading(block, width))
    if heading is None:
        return _by_values(block, values, separator, unit, problems)
    return _by_heading(block, heading, values, separator, unit, problems)


def _values(block: RowBlock, n: int) -> list[str]:
    cells = (row.cells[n].text for row in block.rows[:_WORTH] if n < len(row.cells))
    return [text for text in cells if text]


def _find_heading(block: RowBlock, width: int) -> Row | None:
    """The row with most cells that are known; below it may stand symbols and units."""

    def count_known(row: Row) -> int:
        return sum(
            any(
                pattern.search(text)
                for pattern in (_TIME, _STATE, _VOLTS, _CHANNEL, _EDGE, _INPUT, _MOMENT)
            )
            for text in row.texts
        )

    rows = [row for row in block.headings if len(row.cells) > 1 or width == 1]
    candidates = [row for row in rows if count_known(row)]
    return max(candidates, key=count_known) if candidates else None


def _with_units(block: RowBlock, heading: Row | None) -> Row | None:
    """Join names and the units that stand in a row of their own, as oscilloscopes write them."""
    if heading is None:
        return None

    def units(row: Row) -> list[str]:
        words = [text.strip("()[] ") for text in row.texts]
        are_units = [word.lower() in UNITS or word.lower() in _VOLT_WORDS for word in words if word]
        return words if len(are_units) > 1 and all(are_units) else []

    rows = [row for row in block.headings if len(row.cells) == len(heading.cells)]
    stated = next(filter(None, map(units, rows)), None)
    if stated is None or not _VOLT_WORDS & {word.lower() for word in stated}:
        return heading
    names = (
        heading if not units(heading) else next((row for row in rows if not units(row)), heading)
    )
    cells = []
    for n, (cell, unit) in enumerate(zip(names.cells, stated, strict=True)):
        plain = n == 0 and unit.lower() in UNITS and not _TIME.search(cell.text)
        name = "time" if plain else cell.text
        cells.append(cell._replace(text=f"{name} ({unit})" if unit else name))
    return names._replace(cells=cells)


def _by_heading(
    block: RowBlock,
    heading: Row,
    values: Sequence[list[str]],
    separator: str,
    unit: str | None,
    problems: ProblemList,
) -> Columns:
    columns = Columns()
    durations, states = [], []
    for n, cell in enumerate(heading.cells):
        text = cell.text
        texts = values[n] if n < len(values) else []
        kind = _find_kind(text, texts)
        meaning = _MEANINGS[kind]
        if kind == "state":
            states.append(n)
        elif kind == "duration":
            durations.append(cell)
        elif kind in {"time", "time of an input", "moment"}:
            power = _find_power(block, heading, n, texts, unit, problems)
            dark = _DARKENS.search(text)
            blocked = None if dark is None or kind == "moment" else not (dark[1] or dark[2])
            label = "" if kind != "time of an input" else text if dark is None else _input(text)
            columns.times.append(TimeColumn(n, power, label=label, blocked=blocked))
            columns.row_is_run |= kind == "moment" or blocked is not None
            meaning = f"times in {_SYMBOLS[power]}"
        elif kind == "volts":
            columns.volts[n] = text
        elif kind == "level":
            columns.levels[n] = text
        elif kind in {"edge", "channel", "run"}:
            setattr(columns, kind, n)
        elif kind == "other" and (text or texts):
            columns.unused.append(_name(heading, n))
            _check_unused(heading.line, cell, texts, problems)
        if text or texts:
            columns.meanings[_name(heading, n)] = meaning
    columns.derived = bool(columns.unused)
    _join_row(columns, heading, values, separator)
    _pair_states(columns, heading, states, len(heading.cells))
    _check_gate(columns, heading, values, problems)
    _keep_finest(columns, heading, block, separator)
    if not (columns.times or columns.levels or columns.volts):
        if durations:
            cell = durations[0]
            problems.add(heading.line, cell.column, "", "durations", numbers=repr(cell.text))
        else:
            problems.add(heading.line, heading.cells[0].column, "", "no_time_column")
    return columns


def _check_unused(line: int, cell: TableCell, texts: Sequence[str], problems: ProblemList) -> None:
    """Leave nothing out that may say what an edge is of."""
    if not _DERIVED.search(cell.text) and _few_whole(texts):
        _refuse_to_guess(line, cell, "the gate or the run of a row, or its state", problems)


def _refuse_to_guess(line: int, cell: TableCell, readings: str, problems: ProblemList) -> None:
    values = {"column": cell.text, "readings": readings}
    problems.add(line, cell.column, cell.text, "ambiguous", **values)


def _check_gate(
    columns: Columns, heading: Row, values: Sequence[list[str]], problems: ProblemList
) -> None:
    """Do not guess whether a lone column of 0 and 1 is a gate's number or its state."""
    n = columns.channel
    stated = columns.edge is not None or any(column.state is not None for column in columns.times)
    if n is not None and not stated and set(values[n]) <= {"0", "1"}:
        cell = heading.cells[n]
        _refuse_to_guess(heading.line, cell, "a gate's number or its state", problems)


def _find_kind(text: str, texts: Sequence[str]) -> str:
    """What a column is, by its heading and its values."""
    levels = _levels(texts)
    match = _UNIT.search(text)
    timed = match is not None and (match[1] or "").lower() in UNITS
    by_heading = (
        ("time of an input", _DARKENS, timed and not levels),
        ("moment", _MOMENT, timed and not levels),
        ("state", _STATE, True),
        ("duration", _DURATION, True),
        ("time", _TIME, True),
        ("time of an input", _CHANNEL, timed and not levels),
        ("edge", _EDGE, levels),
        ("volts", _VOLTS, True),
        ("volts", _SCOPE, _fractions(texts)),
        ("level", _INPUT, levels),
        ("run", _NUMBERED_RUN, _all_whole(texts)),
        ("state", _CHANNEL, levels and not _digits(texts)),  # a gate that is blocked or clear
        ("channel", _CHANNEL, bool(texts) and not _fractions(texts)),
        ("counter", _COUNTER, True),
    )
    for kind, pattern, fits in by_heading:
        if fits and pattern.search(text):
            return kind
    return "counter" if _counts(texts) else "other"


def _name(heading: Row, n: int) -> str:
    return heading.cells[n].text or f"column {n + 1}"


def _input(text: str) -> str:
    """Find the name of an input in a heading that says more."""
    match = _ANY_INPUT.search(text)
    return match[0] if match else text


def _join_row(columns: Columns, heading: Row, values: Sequence[list[str]], separator: str) -> None:
    """Find out whether times that stand side by side are one drop: a row each, gate after gate."""
    times = columns.times
    numbered = all(time.label or _NUMBERED.search(heading.cells[time.at].text) for time in times)
    if len(times) < 2 or columns.channel is not None or not numbered or columns.row_is_run:
        return
    if any(_RUN.search(heading.cells[time.at].text) for time in times):
        return
    down = all(_rises(values[time.at], separator) for time in times)
    if columns.run is None and (down and len(values[times[0].at]) > 1):
        return
    columns.row_is_run = True
    for time in times:
        time.label = time.label or heading.cells[time.at].text


def _pair_states(columns: Columns, heading: Row, states: Sequence[int], width: int) -> None:
    """Give each column of times the states that stand behind it, or before the first."""
    paired: list[TimeColumn] = []
    for column, end in pairwise([*columns.times, None]):
        assert column is not None
        behind = [n for n in states if column.at < n < (width if end is None else end.at)]
        before = [n for n in states if n < column.at] if column is columns.times[0] else []
        beside = [*behind, *before]
        if len(beside) < 2:
            column.state = beside[0] if beside else None
            paired.append(column)
            continue
        # One clock, and a column of states for each input.
        names = [heading.cells[n].text for n in beside]
        short = [_input(name) for name in names]
        labels = short if len(set(short)) == len(short) else names
        paired += [TimeColumn(column.at, column.power, n, label)
                   for n, label in zip(beside, labels, strict=True)]  # fmt: skip
    columns.times = paired


def _keep_finest(columns: Columns, heading: Row, block: RowBlock, separator: str) -> None:
    """Of columns that say the same times in other units, keep the finest."""
    if len({column.power for column in columns.times}) < 2:
        return
    finest = max(columns.times, key=lambda column: column.power)
    coarser = [column for column in columns.times if column is not finest]
    if all(_same_times(column, finest, block, separator) for column in coarser):
        state = next((column.state for column in columns.times if column.state is not None), None)
        columns.times = [TimeColumn(finest.at, finest.power, state)]
        # First these: with like headings, what the finest one is stays.
        columns.meanings |= {
            _name(heading, column.at): "the same times, coarser; not used" for column in coarser
        } | {_name(heading, finest.at): f"times in {_SYMBOLS[finest.power]}"}


def _same_times(first: TimeColumn, second: TimeColumn, block: RowBlock, separator: str) -> bool:
    for row in block.rows[:20]:
        if max(first.at, second.at) >= len(row.cells):
            return False
        texts = row.cells[first.at].text, row.cells[second.at].text
        if not all(is_number(text, separator) for text in texts):
            continue
        a, b = (float(text.replace(",", ".")) for text in texts)
        if abs(a * 10.0**-first.power - b * 10.0**-second.power) > 3.0 * 10.0**-first.power:
            return False
    return True


def _find_power(
    block: RowBlock,
    heading: Row,
    n: int,
    texts: Sequence[str],
    stated: str | None,
    problems: ProblemList,
) -> int:
    """Decimal power from seconds: by the heading, a row of units below it, or as stated."""
    cell = heading.cells[n]
    text = _RUN.sub("", cell.text).strip()
    for match in _UNIT.finditer(text):
        unit = next(word for word in match.groups() if word).lower()
        if unit in UNITS:
            return UNITS[unit]
        if match[1]:
            accepted = "a unit of time: s, ms, µs or ns"
            problems.reject(heading.line, cell.column, "time", unit, accepted)
            return 0
    if text.lower() in {"micros", "millis"}:
        return UNITS[text.lower()]
    below = [
        row.cells[n].text.strip("()[] ").lower()
        for row in block.headings
        if row.line > heading.line and n < len(row.cells)
    ]
    unit = next((word for word in below if word in UNITS), stated or "")
    if unit:
        return UNITS[unit]
    return _guess(texts, heading.line, cell.column, problems)


def _guess(texts: Sequence[str], line: int, column: int, problems: ProblemList) -> int:
    """Take times without a unit for seconds, but not whole numbers that run into thousands."""
    if texts and all(re.fullmatch(r"[+-]?[0-9]+", text) for text in texts):
        span = abs(int(texts[-1]) - int(texts[0]))
        if span > 100:
            problems.add(line, column, "time", "unit_missing")
    return 0


def _by_values(
    block: RowBlock,
    values: Sequence[list[str]],
    separator: str,
    unit: str | None,
    problems: ProblemList,
) -> Columns:
    """Without a heading: one column of times, and others that can be nothing else."""
    columns = Columns()
    first = block.rows[0]
    if block.headings and not all(len(row.cells) == 1 for row in block.headings):
        last = block.headings[-1]
        problems.add(last.line, last.cells[0].column, "", "no_time_column")
        return columns
    rest = [n for n, texts in enumerate(values) if not _counts(texts) or len(values) == 1]
    times = [n for n in rest if not _levels(values[n]) and _rises(values[n], separator)]
    if len(values) == 1:
        times = [0]
    fractional = [n for n in times if _fractions(values[n])]
    times = fractional if len(fractional) == 1 else times
    if len(values) == 2 and not times:
        times = [0]  # whatever is wrong with it is said where it is read
    beside = [n for n in rest if n not in times]
    states = [n for n in beside if _levels(values[n])] if len(times) == 1 else []
    gates = [n for n in beside if n not in states and (_few_whole(values[n]) or _names(values[n]))]
    if len(times) != 1 or len(states) > 1 or len(gates) > 1 or len(beside) > len(states + gates):
        if len(values) == 2 and len(times) == 1 and not gates:
            states = beside  # faults in it are said where they are read
        else:
            cell = first.cells[min(2, len(first.cells) - 1)]
            problems.add(first.line, cell.column, "", "no_heading", columns=len(first.cells))
            return columns
    (at,) = times
    cell = first.cells[at]
    power = UNITS[unit] if unit else _guess(values[at], first.line, cell.column, problems)
    # 0 and 1 beside a gate's number are levels: which one is dark is not said.
    state = states[0] if states else None
    signal = bool(states and gates) and not set(map(str.lower, values[states[0]])) <= _STATES
    columns.times = [TimeColumn(at, power, None if signal else state)]
    columns.edge = state if signal else None
    columns.channel = gates[0] if gates else None
    names = {at: f"times in {_SYMBOLS[power]}"}
    names |= dict.fromkeys(gates, "which gate") | dict.fromkeys(states, "states")
    for n in range(len(values)):
        columns.meanings[f"column {n + 1}"] = names.get(n, "counts rows, not used")
    return columns


def _levels(texts: Sequence[str]) -> bool:
    """Whether a column holds two states, or levels, and nothing else."""
    states = BLOCKED | CLEAR | RISING | FALLING | NO_LEVEL
    return bool(texts) and all(as_state(text) in states for text in texts)


def _digits(texts: Sequence[str]) -> bool:
    return all(text[:1].isdigit() for text in texts)


def _all_whole(texts: Sequence[str]) -> bool:
    return bool(texts) and all(_WHOLE.fullmatch(text) for text in texts)


def _names(texts: Sequence[str]) -> bool:
    return bool(texts) and all(NAME_AND_NUMBER.fullmatch(text) for text in texts)


def _few_whole(texts: Sequence[str]) -> bool:
    """Whether a column holds few different whole numbers, again and again."""
    return _all_whole(texts) and len(texts) > 2 * len(set(texts))


def _fractions(texts: Sequence[str]) -> bool:
    return any("." in text or "," in text for text in texts)


def _counts(texts: Sequence[str]) -> bool:
    """Whether a column counts its rows."""
    if len(texts) < 2 or not all(re.fullmatch("[0-9]+", text) for text in texts):
        return False
    numbers = [int(text) for text in texts]
    return numbers[0] in {0, 1} and all(b - a == 1 for a, b in pairwise(numbers))


def _rises(texts: Sequence[str], separator: str) -> bool:
    if not texts or not all(is_number(text, separator) for text in texts):
        return False
    numbers = [float(text.replace(",", ".")) for text in texts]
    return all(a <= b for a, b in pairwise(numbers))
