"""What each column of a timer's table is, and which times belong to which states or volts.

Facts are collected of each column (of its heading, its unit, its values), and the first rule of
`columns.txt` that they fulfil says what it is. The project's own format has columns that are known
beforehand.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

from rig.timers import vocabulary
from rig.timers.edge_rows import HEADER
from rig.timers.table import Row, RowBlock, Table, count_known, find_time_base
from rig.timers.vocabulary import POWERS, SYMBOLS, find_label, is_number, normal, words

if TYPE_CHECKING:
    from rig.timers.problems import ProblemList

VALUES = (("level", "volts"), ("state",), ("edge",), ())
"""Roles that say what happened; of a table that has several, the first are read."""
_UNITS = {*POWERS, "v"}
MAX_COLUMNS = 200
_FEWEST_TIMES = 4
"""Columns, each later than the one before, that are times side by side."""


@cache
def roles() -> dict[str, list[str]]:
    """Return of each role its meaning, a cell's form, what is accepted, and what 0 and 1 mean."""
    return {name: row for name, *row in vocabulary.read_rows("roles.txt", " |")}


@dataclass(eq=False, slots=True)
class TimerColumn:
    """What a column is.

    Attributes
    ----------
    at
        Which column, from 0.
    name
        Its heading.
    role
        A key of `roles`.
    power
        Of times: decimal power from seconds; `None` where the file does not say it.
    gate, run
        Which input and which run all its values are of; empty where the heading does not say.
    state
        ``blocked`` or ``clear`` where the heading says what all its times did to the beam.
    numbered
        Whether it is one of times side by side: ``t1``, ``Stop 2``.
    """

    at: int
    name: str
    role: str
    power: int | None = 0
    gate: str = ""
    run: str = ""
    state: str = ""
    numbered: bool = False

    @property
    def meaning(self) -> str:
        """What it was taken for, in words."""
        return roles()[self.role][0] + f" in {SYMBOLS[self.power]}" * (self.role == "time")


@dataclass(eq=False, slots=True)
class Signal:
    """A column of times with the column that says what happened, of an input and of a run.

    Attributes
    ----------
    clock
        Of its times, or of the numbers of its samples; `None` where rows are counted.
    value
        Its states, levels or volts; `None` where all its times are of the same kind.
    """

    clock: TimerColumn | None
    value: TimerColumn | None
    run: str
    label: str = ""


@cache
def _rules() -> list[tuple[str, set[str], set[str]]]:
    return [
        (role, {f for f in facts.split() if f[0] != "-"}, set(re.findall(r"-(\S+)", facts)))
        for role, facts in vocabulary.read_rows("columns.txt", ":")
    ]


def _find_role(facts: set[str]) -> str:
    fitting = (role for role, needed, barred in _rules() if needed <= facts and not barred & facts)
    return next(fitting, "other")


def columns_of(
    block: RowBlock, rows: Sequence[Row], table: Table, unit: str | None
) -> list[TimerColumn]:
    """Find out what the columns of a block are, and note faults at their places.

    Parameters
    ----------
    rows
        The first ones.
    unit
        Of the times where the file does not say, a key of `POWERS`.
    """
    problems, width = table.problems, max(len(row.texts) for row in rows)
    if width > MAX_COLUMNS:
        problems.refuse(rows[0].line, 1, "too_many_columns", columns=width, limit=MAX_COLUMNS)
    if table.is_own:
        if tuple(text.lower() for text in block.headings[0].texts) != HEADER:
            line = block.headings[0].line
            problems.refuse(line, 1, "wrong_header", header=",".join(HEADER))
        own = zip(HEADER, ("run", "gate", "time", "state"), strict=True)
        return [TimerColumn(n, name, role) for n, (name, role) in enumerate(own)]
    is_named = any(len(row.texts) > 1 or width == 1 for row in block.headings)
    if not is_named or all(len(row.texts) != width for row in block.headings):
        block.headings += block.above  # one without a heading has that of the block above
    cells = {n: [text for row in rows if (text := row.cell(n))] for n in range(width)}
    facts = {n: _facts_of_values(texts) for n, texts in cells.items() if texts}
    heading = _find_heading(block, facts, width)
    if all("levels" in fact for fact in facts.values()):
        heading = _name_levels(len(facts), block, table) or heading
    if heading is None and _is_each_row_rising(rows, width):
        heading = Row(0, [f"moment {n}" for n in range(1, width + 1)])
    bare = set() if heading else {"bare", *({"single"} if len(facts) == 1 else set())}
    is_rising = any({"rises", "fractions"} <= fact - {"levels"} for fact in facts.values())
    for fact in facts.values():
        fact.update(bare, {"rival"} if is_rising and "fractions" not in fact else ())
    columns = [_read_heading(block, heading, n, fact) for n, fact in facts.items()]
    if any(column.role in {"edge", "state"} for column in columns):
        columns = [_read_heading(block, heading, n, {*facts[n], "stated"}) for n in facts]
    _check(block, columns, heading, rows, unit, table.problems)
    # Of columns that say the same times in other units, the finest is kept.
    times = [c for c in columns if c.role == "time" and not c.numbered and c.power is not None]
    finest = {(c.gate, c.run, c.state): c for c in sorted(times, key=lambda c: c.power or 0)}
    for column in times:
        if (column.power or 0) < (finest[column.gate, column.run, column.state].power or 0):
            column.role = "coarse"
    if not any(column.role == "time" for column in columns):
        _set_base(block, rows[0], table, columns)
    return columns


def _check(
    block: RowBlock,
    columns: Sequence[TimerColumn],
    heading: Row | None,
    rows: Sequence[Row],
    unit: str | None,
    problems: ProblemList,
) -> None:
    """Set what the values of a column say more, and refuse what may be this or that."""
    if heading is None:
        _check_bare(block, columns, rows[0], problems)
    for column in columns:
        named, texts = heading or rows[0], list(filter(None, (row.cell(column.at) for row in rows)))
        place = named.line, named.column(column.at)
        if column.role == "level" and len(texts) < len(rows):
            column.role = "state"  # of samples, each row has every level
        if column.role == "time" and column.power is None:
            column.power = POWERS[unit] if unit else _plain_power(texts)
        if column.role[0] == "?":
            readings = column.role[1:]
            problems.add(*place, column.name, "ambiguous", column=column.name, readings=readings)
        stated = vocabulary.unit_of(column.name) if heading and column.role == "time" else ""
        if stated not in {*POWERS, ""} and not find_label(stated, "gate"):
            problems.reject(*place, "time", stated, "a unit of time: s, ms, µs or ns")


def _set_base(block: RowBlock, first: Row, table: Table, columns: Sequence[TimerColumn]) -> None:
    """Set when samples without times begin, and the time between them; refuse other rows."""
    stated = find_time_base([*table.remarks, *block.headings])
    durations = ", ".join(repr(c.name) for c in columns if c.role == "duration")
    if not any(column.role in VALUES[0] for column in columns):
        place, code = (
            (block.headings or [first])[0].line,
            "durations" if durations else "no_time_column",
        )
        table.problems.add(place, 1, "", code, numbers=durations)
    elif stated is None:
        table.problems.add(first.line, 1, "", "no_rate", lacks="a column of times or a rate")
    block.base = stated or block.base


def _is_each_row_rising(rows: Sequence[Row], width: int) -> bool:
    """Whether each row is a list of times, one after the other, as programs print them."""
    numbers = [[float(text) for text in row.texts if is_number(text)] for row in rows]
    is_list = all(len(row) == width and sorted(set(row)) == row for row in numbers)
    return width >= _FEWEST_TIMES and is_list


def _name_levels(width: int, block: RowBlock, table: Table) -> Row | None:
    """Return a heading for levels that have only a rate: as a remark lists, or D0, D1."""
    labels = {text.casefold() for row in block.headings[-1:] for text in row.texts}
    if labels - {"logic", "analog"} or not find_time_base([*table.remarks, *block.headings]):
        return None
    lists = [row.raw.partition(":")[2].split(",") for row in table.remarks]
    names = next((n for n in lists if len(n) == width), [f"D{n}" for n in range(width)])
    texts = (text.strip() for text in names)
    return Row(0, [text if find_label(text, "gate") else f"input {text}" for text in texts])


def _check_bare(
    block: RowBlock, columns: Sequence[TimerColumn], first: Row, problems: ProblemList
) -> None:
    """Refuse columns without a heading that may be something else."""
    counts = Counter(column.role for column in columns)
    repeated = max(counts["state"], counts["edge"], counts["gate"]) > 1
    # Two traces of an oscilloscope stand beside each other, each with its times.
    if repeated or counts["other"] or counts["time"] not in {1, counts["volts"] or 1}:
        place = first.column(columns[min(2, len(columns) - 1)].at)
        problems.add(first.line, place, "", "no_heading", columns=len(columns))
    texts = sorted((n, text) for row in block.headings for n, text in enumerate(row.texts))
    labels = [(n, label) for n, text in texts if (label := find_label(text, "gate"))]
    traces = list(zip([c for c in columns if c.role == "volts"], labels, strict=False))
    # Settings name traces if each name is equally far to the left of its trace.
    if len({trace.at - n for trace, (n, _) in traces}) == 1:
        for trace, (_, label) in traces:
            trace.gate = label


def _find_heading(block: RowBlock, filled: Collection[int], width: int) -> Row | None:
    """Return the row with most cells that are known; above and below may stand symbols, units.

    A row with a measured number, or with more names than there are columns, is a setting.
    """
    rows = [
        row
        for row in block.headings
        if count_known(row)
        and (len(row.texts) > 1 or len(filled) == 1)
        and any(text and not is_number(text) and n in filled for n, text in enumerate(row.texts))
        and not any(
            text and "setting" not in vocabulary.roles_in(text) for text in row.texts[width:]
        )
        and not any(is_number(text) and not text.isdecimal() for text in row.texts[:width])
    ]
    return max(rows, key=lambda row: (count_known(row), len("".join(row.texts))), default=None)


def _read_heading(block: RowBlock, heading: Row | None, n: int, facts: set[str]) -> TimerColumn:
    """Find out what a column is by its heading; the other rows above it may say unit or gate."""
    name, beside = (
        heading.cell(n) if heading else "",
        [r.cell(n) for r in block.headings if r is not heading],
    )
    prefix, colon, rest = name.partition(":")
    column = TimerColumn(n, name or f"column {n + 1}", "", run=find_label(name, "run"))
    name = name.replace(column.run, " ") if column.run else name
    if colon and rest.strip() and not find_label(prefix, "gate"):
        column.run, name = column.run or prefix.strip(), rest
    below = [row.cell(n).strip("()[] ") for row in block.headings if _has_units(row)]
    units = [vocabulary.unit_of(text) for text in (name, *below)]
    unit = next((unit for unit in units if unit in _UNITS), units[0])
    column.gate = next(filter(None, map(_find_gate, [name, *beside])), "")
    kinds = dict.fromkeys(POWERS, "timed") | {"v": "volt", "": "unitless"}
    facts = facts | vocabulary.roles_in(name)
    facts |= {kinds.get(unit, ""), "labelled" * bool(column.gate), "numbered" * bool(column.run)}
    if unit in POWERS and normal(name).strip("()[] ") in words()[f"unit {unit}"]:
        facts |= {"time"}
    column.role = _find_role(facts)
    if column.role == "time":
        column.power = POWERS.get(unit if unit or "_" in name else normal(name))
        column.state = next((state for state in ("clear", "blocked") if state in facts), "")
        is_counted = re.search(r"^\D{1,12}[0-9]{1,3}(?![0-9])", name.strip()) is not None
        column.numbered = is_counted or "moment" in facts
    return column


def _has_units(row: Row) -> bool:
    """Whether a row has units only, perhaps behind their name: ``Y_Unit_Label``."""
    texts = [normal(text.strip("()[] ")) for text in row.texts if text.strip("-")]
    units = set().union(*(listed for role, listed in words().items() if role.startswith("unit")))
    is_unit = [text in units or (not n and "unit" in text) for n, text in enumerate(texts)]
    return len(texts) > 0 and all(is_unit)


def _find_gate(text: str) -> str:
    bare = re.fullmatch(r"\s*[0-9]{1,3}\s*", text[:20])
    return text.strip() if bare else find_label(text, "gate")


def _plain_power(texts: Sequence[str]) -> int | None:
    """Return the power of times without a unit: fractions are seconds, and small whole numbers."""
    if not all(re.fullmatch(r"[+-]?[0-9]{1,30}", text) for text in texts):
        return 0
    return 0 if abs(int(texts[-1]) - int(texts[0])) <= 100 else None


def _facts_of_values(texts: Sequence[str]) -> set[str]:
    states = [vocabulary.state_of(text) or text.casefold() in {"x", "z"} for text in texts]
    numbers = [float(text) for text in texts if is_number(text)]
    is_whole = all(vocabulary.number_of(t) is not None and not set(t) & set(".,+-") for t in texts)
    steps, is_numeric = {b - a for a, b in pairwise(numbers)}, len(numbers) == len(texts)
    facts = {
        "levels": all(states),
        "plain": not {"blocked", "clear"} & set(states),
        "fractions": any("." in text or "," in text for text in texts),
        "rises": is_numeric and min(steps, default=0.0) >= 0.0,
        "counts": is_numeric and is_whole and numbers[0] in {0, 1} and steps == {1.0},
        "few": is_whole and len(texts) >= 2 * len(set(texts)),
        "binary": set(texts) <= {"0", "1"},
        "words": not numbers,
        "short": len(texts) < 3,
        "many": len(texts) > 30,
    }
    return {fact for fact, holds in facts.items() if holds}


def find_signals(columns: Sequence[TimerColumn]) -> list[Signal]:
    """Give each column of times the values that belong to it: of its run, and of its input."""
    chosen = ([c for c in columns if c.role in listed] for listed in VALUES)
    values = next(filter(None, chosen), [])
    times = [column for column in columns if column.role == "time"]
    count = next((column for column in columns if column.role == "index"), None)
    signals = [
        Signal(clock, value, clock.run or (value.run if value else ""))
        for clock in times
        for value in _values_of(clock, times, values) or (None,)
    ] or [Signal(count, value, value.run) for value in values]
    if any(value.role in VALUES[0] for value in values):
        signals = [signal for signal in signals if signal.value]
    for signal in signals:
        signal.label = _label_of(signal, signals)
    return signals


def _values_of(
    clock: TimerColumn, times: Sequence[TimerColumn], values: Sequence[TimerColumn]
) -> list[TimerColumn]:
    """Return the values whose times a column has: those of its gate, or the nearest ones."""
    beside = [other for other in times if other.run == clock.run]
    own = [value for value in values if not clock.run or value.run in {clock.run, ""}]
    if len(beside) == 1:
        return own
    near = [v for v in own if clock is min(beside, key=lambda c: (c.at > v.at, abs(c.at - v.at)))]
    return [value for value in own if clock.gate and value.gate == clock.gate] or near[-1:]


def _label_of(signal: Signal, signals: Sequence[Signal]) -> str:
    """Return what the file calls an input: its heading, or only the gate's name in it."""
    clock, value = signal.clock, signal.value
    gate = clock.gate if clock else ""
    if value is None:
        alike = [s for s in signals if s.clock and s.clock.gate == gate]
        is_own = clock and gate in clock.name and not (clock.run or clock.state)
        return clock.name if clock and gate and len(alike) == 1 and is_own else gate
    if value.role in VALUES[0]:
        return value.name if value.gate in value.name or not value.gate else value.gate
    if sum(other.clock is clock for other in signals) > 1:
        return value.gate or value.name
    is_only = all(other.clock is clock or other.run != signal.run for other in signals)
    return gate or ("" if is_only else value.gate)
