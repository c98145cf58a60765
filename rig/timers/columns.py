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
_SAID = {
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
    said
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
    said: dict[str, str] = field(default_factory=dict)


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
    heading = _with_units(block, _heading(block, width))
    if heading is None:
        return _by_values(block, values, separator, unit, problems)
    return _by_heading(block, heading, values, separator, unit, problems)


def _values(block: RowBlock, n: int) -> list[str]:
    cells = (row.cells[n].text for row in block.rows[:_WORTH] if n < len(row.cells))
    return [text for text in cells if text]


def _heading(block: RowBlock, width: int) -> Row | None:
    """The row with most cells that are known; below it may stand symbols and units."""

    def known(row: Row) -> int:
        return sum(
            any(
                one.search(text)
                for one in (_TIME, _STATE, _VOLTS, _CHANNEL, _EDGE, _INPUT, _MOMENT)
            )
            for text in row.texts
        )

    rows = [row for row in block.headings if len(row.cells) > 1 or width == 1]
    named = [row for row in rows if known(row)]
    return max(named, key=known) if named else None


def _with_units(block: RowBlock, heading: Row | None) -> Row | None:
    """Join names and the units that stand in a row of their own, as oscilloscopes write them."""
    if heading is None:
        return None

    def units(row: Row) -> list[str]:
        said = [text.strip("()[] ") for text in row.texts]
        known = [one.lower() in UNITS or one.lower() in _VOLT_WORDS for one in said if one]
        return said if len(known) > 1 and all(known) else []

    rows = [row for row in block.headings if len(row.cells) == len(heading.cells)]
    stated = next(filter(None, map(units, rows)), None)
    if stated is None or not _VOLT_WORDS & {one.lower() for one in stated}:
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
    found = Columns()
    durations, states = [], []
    for n, cell in enumerate(heading.cells):
        text = cell.text
        here = values[n] if n < len(values) else []
        kind = _kind(text, here)
        said = _SAID[kind]
        if kind == "state":
            states.append(n)
        elif kind == "duration":
            durations.append(cell)
        elif kind in {"time", "time of an input", "moment"}:
            power = _power(block, heading, n, here, unit, problems)
            dark = _DARKENS.search(text)
            blocked = None if dark is None or kind == "moment" else not (dark[1] or dark[2])
            label = "" if kind != "time of an input" else text if dark is None else _input(text)
            found.times.append(TimeColumn(n, power, label=label, blocked=blocked))
            found.row_is_run |= kind == "moment" or blocked is not None
            said = f"times in {_SYMBOLS[power]}"
        elif kind == "volts":
            found.volts[n] = text
        elif kind == "level":
            found.levels[n] = text
        elif kind in {"edge", "channel", "run"}:
            setattr(found, kind, n)
        elif kind == "other" and (text or here):
            found.unused.append(_name(heading, n))
            _check_unused(heading.line, cell, here, problems)
        if text or here:
            found.said[_name(heading, n)] = said
    found.derived = bool(found.unused)
    _side_by_side(found, heading, values, separator)
    _pair_states(found, heading, states, len(heading.cells))
    _check_gate(found, heading, values, problems)
    _one_clock(found, heading, block, separator)
    if not (found.times or found.levels or found.volts):
        if durations:
            cell = durations[0]
            problems.add(heading.line, cell.column, "", "durations", numbers=repr(cell.text))
        else:
            problems.add(heading.line, heading.cells[0].column, "", "no_time_column")
    return found


def _check_unused(line: int, cell: TableCell, here: Sequence[str], problems: ProblemList) -> None:
    """Leave nothing out that may say what an edge is of."""
    if not _DERIVED.search(cell.text) and _few_whole(here):
        _refuse_to_guess(line, cell, "the gate or the run of a row, or its state", problems)


def _refuse_to_guess(line: int, cell: TableCell, readings: str, problems: ProblemList) -> None:
    values = {"column": cell.text, "readings": readings}
    problems.add(line, cell.column, cell.text, "ambiguous", **values)


def _check_gate(
    found: Columns, heading: Row, values: Sequence[list[str]], problems: ProblemList
) -> None:
    """Do not guess whether a lone column of 0 and 1 is a gate's number or its state."""
    n = found.channel
    stated = found.edge is not None or any(one.state is not None for one in found.times)
    if n is not None and not stated and set(values[n]) <= {"0", "1"}:
        cell = heading.cells[n]
        _refuse_to_guess(heading.line, cell, "a gate's number or its state", problems)


def _kind(text: str, here: Sequence[str]) -> str:
    """What a column is, by its heading and its values."""
    levels = _levels(here)
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
        ("volts", _SCOPE, _fractions(here)),
        ("level", _INPUT, levels),
        ("run", _NUMBERED_RUN, _whole(here)),
        ("state", _CHANNEL, levels and not _digits(here)),  # a gate that is blocked or clear
        ("channel", _CHANNEL, bool(here) and not _fractions(here)),
        ("counter", _COUNTER, True),
    )
    for kind, pattern, fits in by_heading:
        if fits and pattern.search(text):
            return kind
    return "counter" if _counts(here) else "other"


def _name(heading: Row, n: int) -> str:
    return heading.cells[n].text or f"column {n + 1}"


def _input(text: str) -> str:
    """Find the name of an input in a heading that says more."""
    match = _ANY_INPUT.search(text)
    return match[0] if match else text


def _side_by_side(
    found: Columns, heading: Row, values: Sequence[list[str]], separator: str
) -> None:
    """Find out whether times that stand side by side are one drop: a row each, gate after gate."""
    times = found.times
    numbered = all(one.label or _NUMBERED.search(heading.cells[one.at].text) for one in times)
    if len(times) < 2 or found.channel is not None or not numbered or found.row_is_run:
        return
    if any(_RUN.search(heading.cells[one.at].text) for one in times):
        return
    down = all(_rises(values[one.at], separator) for one in times)
    if found.run is None and (down and len(values[times[0].at]) > 1):
        return
    found.row_is_run = True
    for one in times:
        one.label = one.label or heading.cells[one.at].text


def _pair_states(found: Columns, heading: Row, states: Sequence[int], width: int) -> None:
    """Give each column of times the states that stand behind it, or before the first."""
    paired: list[TimeColumn] = []
    for one, end in pairwise([*found.times, None]):
        assert one is not None
        behind = [n for n in states if one.at < n < (width if end is None else end.at)]
        before = [n for n in states if n < one.at] if one is found.times[0] else []
        here = [*behind, *before]
        if len(here) < 2:
            one.state = here[0] if here else None
            paired.append(one)
            continue
        # One clock, and a column of states for each input.
        names = [heading.cells[n].text for n in here]
        short = [_input(name) for name in names]
        labels = short if len(set(short)) == len(short) else names
        paired += [TimeColumn(one.at, one.power, n, label)
                   for n, label in zip(here, labels, strict=True)]  # fmt: skip
    found.times = paired


def _one_clock(found: Columns, heading: Row, block: RowBlock, separator: str) -> None:
    """Of columns that say the same times in other units, keep the finest."""
    if len({one.power for one in found.times}) < 2:
        return
    finest = max(found.times, key=lambda one: one.power)
    coarser = [one for one in found.times if one is not finest]
    if all(_same(one, finest, block, separator) for one in coarser):
        state = next((one.state for one in found.times if one.state is not None), None)
        found.times = [TimeColumn(finest.at, finest.power, state)]
        # First these: with like headings, what the finest one is stays.
        found.said |= {
            _name(heading, one.at): "the same times, coarser; not used" for one in coarser
        } | {_name(heading, finest.at): f"times in {_SYMBOLS[finest.power]}"}


def _same(one: TimeColumn, other: TimeColumn, block: RowBlock, separator: str) -> bool:
    for row in block.rows[:20]:
        if max(one.at, other.at) >= len(row.cells):
            return False
        texts = row.cells[one.at].text, row.cells[other.at].text
        if not all(is_number(text, separator) for text in texts):
            continue
        a, b = (float(text.replace(",", ".")) for text in texts)
        if abs(a * 10.0**-one.power - b * 10.0**-other.power) > 3.0 * 10.0**-one.power:
            return False
    return True


def _power(
    block: RowBlock,
    heading: Row,
    n: int,
    here: Sequence[str],
    stated: str | None,
    problems: ProblemList,
) -> int:
    """Decimal power from seconds: by the heading, a row of units below it, or as stated."""
    cell = heading.cells[n]
    text = _RUN.sub("", cell.text).strip()
    for match in _UNIT.finditer(text):
        unit = next(one for one in match.groups() if one).lower()
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
    unit = next((one for one in below if one in UNITS), stated or "")
    if unit:
        return UNITS[unit]
    return _bare(here, heading.line, cell.column, problems)


def _bare(here: Sequence[str], line: int, column: int, problems: ProblemList) -> int:
    """Take times without a unit for seconds, but not whole numbers that run into thousands."""
    if here and all(re.fullmatch(r"[+-]?[0-9]+", text) for text in here):
        span = abs(int(here[-1]) - int(here[0]))
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
    found = Columns()
    first = block.rows[0]
    if block.headings and not all(len(row.cells) == 1 for row in block.headings):
        last = block.headings[-1]
        problems.add(last.line, last.cells[0].column, "", "no_time_column")
        return found
    rest = [n for n, here in enumerate(values) if not _counts(here) or len(values) == 1]
    times = [n for n in rest if not _levels(values[n]) and _rises(values[n], separator)]
    if len(values) == 1:
        times = [0]
    fractional = [n for n in times if _fractions(values[n])]
    times = fractional if len(fractional) == 1 else times
    if len(values) == 2 and not times:
        times = [0]  # whatever is wrong with it is said where it is read
    others = [n for n in rest if n not in times]
    states = [n for n in others if _levels(values[n])] if len(times) == 1 else []
    gates = [n for n in others if n not in states and (_few_whole(values[n]) or _names(values[n]))]
    if len(times) != 1 or len(states) > 1 or len(gates) > 1 or len(others) > len(states + gates):
        if len(values) == 2 and len(times) == 1 and not gates:
            states = others  # faults in it are said where they are read
        else:
            cell = first.cells[min(2, len(first.cells) - 1)]
            problems.add(first.line, cell.column, "", "no_heading", columns=len(first.cells))
            return found
    (at,) = times
    power = UNITS[unit] if unit else _bare(values[at], first.line, first.cells[at].column, problems)
    # 0 and 1 beside a gate's number are levels: which one is dark is not said.
    state = states[0] if states else None
    signal = bool(states and gates) and not set(map(str.lower, values[states[0]])) <= _STATES
    found.times = [TimeColumn(at, power, None if signal else state)]
    found.edge = state if signal else None
    found.channel = gates[0] if gates else None
    names = {at: f"times in {_SYMBOLS[power]}"}
    names |= dict.fromkeys(gates, "which gate") | dict.fromkeys(states, "states")
    for n in range(len(values)):
        found.said[f"column {n + 1}"] = names.get(n, "counts rows, not used")
    return found


def _levels(here: Sequence[str]) -> bool:
    """Whether a column holds two states, or levels, and nothing else."""
    known = BLOCKED | CLEAR | RISING | FALLING | NO_LEVEL
    return bool(here) and all(as_state(text) in known for text in here)


def _digits(here: Sequence[str]) -> bool:
    return all(text[:1].isdigit() for text in here)


def _whole(here: Sequence[str]) -> bool:
    return bool(here) and all(_WHOLE.fullmatch(text) for text in here)


def _names(here: Sequence[str]) -> bool:
    return bool(here) and all(NAME_AND_NUMBER.fullmatch(text) for text in here)


def _few_whole(here: Sequence[str]) -> bool:
    """Whether a column holds few different whole numbers, again and again."""
    return _whole(here) and len(here) > 2 * len(set(here))


def _fractions(here: Sequence[str]) -> bool:
    return any("." in text or "," in text for text in here)


def _counts(here: Sequence[str]) -> bool:
    """Whether a column counts its rows."""
    if len(here) < 2 or not all(re.fullmatch("[0-9]+", text) for text in here):
        return False
    numbers = [int(text) for text in here]
    return numbers[0] in {0, 1} and all(b - a == 1 for a, b in pairwise(numbers))


def _rises(here: Sequence[str], separator: str) -> bool:
    if not here or not all(is_number(text, separator) for text in here):
        return False
    numbers = [float(text.replace(",", ".")) for text in here]
    return all(a <= b for a, b in pairwise(numbers))
