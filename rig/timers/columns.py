"""What each column of a timer's table is, and which times belong to which states or volts.

Facts are collected of each column (of its heading, its unit, its values), and the first rule of
`columns.txt` that they fulfil says what it is, or what it may be.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

from rig.timers import vocabulary
from rig.timers.table import Row, RowBlock, count_known, find_time_base
from rig.timers.vocabulary import POWERS, SYMBOLS, find_label, is_number, normal, words

if TYPE_CHECKING:
    from rig.timers.problems import ProblemList
    from rig.timers.timer_file import TimerFile

VALUES = (("level", "volts"), ("state", "cleared"), ("edge",), ())
"""Roles that say what happened; of a table that has several, the first are read."""
_UNITS = {*POWERS, "v"}
_MOST_COLUMNS = 200
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
        meaning = " or ".join(roles()[role][0] for role in self.role.split("|"))
        return meaning + f" in {SYMBOLS[self.power]}" * (self.role == "time")


ROW_COUNT = TimerColumn(-1, "", "index")
"""Where rows have neither times nor numbers, they are counted."""


class Signal(NamedTuple):
    """A column of times with the column that says what happened, of an input and of a run.

    Attributes
    ----------
    clock
        Of its times, or of the numbers of its samples.
    value
        Its states, levels or volts; `None` where all its times are of the same kind.
    run, label
        What the file calls the run and the input; empty where it does not say.
    """

    clock: TimerColumn
    value: TimerColumn | None
    run: str
    label: str


def _find_role(facts: set[str]) -> str:
    return next(
        role
        for role, rule in vocabulary.read_rows("columns.txt", ":")
        if all((fact.lstrip("-") in facts) is (fact[0] != "-") for fact in rule.split())
    )


def columns_of(
    file: TimerFile, block: RowBlock, rows: Sequence[Row], problems: ProblemList
) -> list[TimerColumn]:
    """Find out what the columns of a block are, in the way in which the file is read.

    Parameters
    ----------
    rows
        The first ones.

    Raises
    ------
    InputError
        Columns that may be several things, that are no times, or units that are none.
    """
    width = max(len(row.texts) for row in rows)
    if width > _MOST_COLUMNS:
        problems.refuse(rows[0].line, 1, "too_many_columns", columns=width, limit=_MOST_COLUMNS)
    if all(len(row.texts) != width for row in block.headings):
        block.headings += block.above  # one without a heading has that of the block above
    cells = {n: [text for row in rows if (text := row.cell(n))] for n in range(width)}
    facts = {n: _facts_of_values(texts) for n, texts in cells.items() if texts}
    heading = _find_heading(block, facts, width)
    if all("levels" in fact for fact in facts.values()):
        heading = _name_levels(len(facts), block) or heading
    if heading is None and _is_each_row_rising(rows, width):
        heading = Row(0, [f"moment {n}" for n in range(1, width + 1)])
    is_rising = any({"rises", "fractions"} <= fact for fact in facts.values())
    for n, fact in facts.items():
        is_bare = heading is None or not (heading.line or heading.cell(n))
        fact.update({"bare"} if is_bare else (), {"single"} if len(facts) == 1 else ())
        fact.update({"rival"} if is_rising and "fractions" not in fact else ())
    columns = [_read_heading(block, heading, n, fact) for n, fact in facts.items()]
    for column in columns:
        if column.role == "level" and len(cells[column.at]) < len(rows):
            column.role = "state"  # of samples, each row has every level
        if column.role == "time" and column.power is None:
            # Fractions are seconds, and so are small whole numbers.
            is_count = all(re.fullmatch(r"[+-]?[0-9]{1,30}", text) for text in cells[column.at])
            is_long = is_count and abs(int(cells[column.at][-1]) - int(cells[column.at][0])) > 100
            column.power = POWERS[file.unit] if file.unit else None if is_long else 0
    _name_traces(block, columns if heading is None else [])
    # Of columns that say the same times in other units, the finest is kept.
    times = [c for c in columns if c.role == "time" and not c.numbered and c.power is not None]
    finest = {(c.gate, c.run, c.state): c.power for c in sorted(times, key=attrgetter("power"))}
    for column in times:
        if column.power != finest[column.gate, column.run, column.state]:
            column.role = "coarse"
    unclear = [column for column in columns if "|" in column.role]
    for column in unclear if len(unclear) == 1 else ():  # of several, falls cannot decide
        readings = column.role.split("|")
        file.ways, column.role = max(file.ways, len(readings)), readings[file.way % len(readings)]
    _check_columns(columns, heading, rows[0], problems)
    return columns


def _is_each_row_rising(rows: Sequence[Row], width: int) -> bool:
    """Whether each row is a list of times, one after the other, as programs print them."""
    numbers = [[float(text) for text in row.texts if is_number(text)] for row in rows]
    is_list = all(len(row) == width and sorted(set(row)) == row for row in numbers)
    return width >= _FEWEST_TIMES and is_list


def _name_levels(width: int, block: RowBlock) -> Row | None:
    """Return a heading for levels that have only a rate: as a remark lists, or D0, D1."""
    labels = {text.casefold() for row in block.headings[-1:] for text in row.texts}
    if labels - {"logic", "analog"} or not find_time_base(block):
        return None
    lists = [row.raw.partition(":")[2].split(",") for row in block.remarks]
    names = next((n for n in lists if len(n) == width), [f"D{n}" for n in range(width)])
    texts = (text.strip() for text in names)
    return Row(0, [text if find_label(text, "gate") else f"input {text}" for text in texts])


def _name_traces(block: RowBlock, columns: Sequence[TimerColumn]) -> None:
    """Name volts without a heading as settings do, each equally far to the left of its trace."""
    texts = sorted((n, text) for row in block.headings for n, text in enumerate(row.texts))
    labels = [(n, label) for n, text in texts if (label := find_label(text, "gate"))]
    traces = list(zip([c for c in columns if c.role == "volts"], labels, strict=False))
    distances = {trace.at - n for trace, (n, _) in traces}
    if len(distances) == 1 and min(distances) >= 0:
        for trace, (_, label) in traces:
            trace.gate = label


def _check_columns(
    columns: Sequence[TimerColumn], heading: Row | None, first: Row, problems: ProblemList
) -> None:
    """Refuse columns without a heading that may be something else, and units that are none."""
    counts, above = Counter(column.role for column in columns), heading or first
    repeated = max(counts["state"], counts["edge"], counts["gate"]) > 1
    # Two traces of an oscilloscope stand beside each other, each with its times.
    is_open = repeated or counts["other"] or counts["time"] not in {1, counts["volts"] or 1}
    if heading is None and is_open:
        place = first.place(columns[min(2, len(columns) - 1)].at)
        problems.add(*place, "", "no_heading", columns=len(columns))
    for column in columns if heading else ():
        place, unit = above.place(column.at), vocabulary.unit_of(column.name)
        if column.role == "setting" or "|" in column.role:
            values = {"column": column.name, "readings": column.meaning}
            problems.add(*place, column.name, "ambiguous", **values)
        elif column.role == "time" and unit not in {*POWERS, ""} and not find_label(unit, "gate"):
            problems.reject(*place, "time", unit, "a unit of time: s, ms, µs or ns")
    if not counts.keys() & {"time", *VALUES[0]}:
        durations = ", ".join(repr(column.name) for column in columns if column.role == "duration")
        code = "durations" if durations else "no_time_column"
        problems.add(above.line, 1, "", code, numbers=durations)
    problems.raise_if_any()


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
    below = [row.cell(n) for row in block.headings if _has_units(row)]
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
        column.numbered = "moment" in facts
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


def _facts_of_values(texts: Sequence[str]) -> set[str]:
    kinds = [vocabulary.kinds_of(text) for text in texts]
    numbers = [float(text) for text in texts if is_number(text)]
    is_whole = all(vocabulary.number_of(t) is not None and not set(t) & set(".,+-") for t in texts)
    steps, is_numeric = {b - a for a, b in pairwise(numbers)}, len(numbers) == len(texts)
    facts = {
        "levels": all("state" in kind for kind in kinds),
        "suffixed": all({"timed", "clock"} & kind for kind in kinds),
        "plain": not any({"blocked", "clear"} & kind for kind in kinds),
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
    if not times:
        count = next((column for column in columns if column.role == "index"), ROW_COUNT)
        return [Signal(count, value, value.run, _label_of(value)) for value in values]
    owners = [(_clock_of(value, times), value) for value in values]
    signals = []
    for clock in times:
        own = [value for owner, value in owners if owner is clock]
        is_lone = sum(other.gate == clock.gate for other in times) == 1
        is_named = is_lone and clock.gate in clock.name and not (clock.run or clock.state)
        label = clock.name if clock.gate and is_named else clock.gate
        for value in own:
            run = clock.run or value.run
            if value.role in VALUES[0] or len(own) > 1:
                signals.append(Signal(clock, value, run, _label_of(value)))
            else:
                is_only = all(t is clock or t.run != clock.run for t in times)
                signals.append(Signal(clock, value, run, clock.gate or value.gate * (not is_only)))
        if not own and not (values and values[0].role in VALUES[0]):
            signals.append(Signal(clock, None, clock.run, label))
    return signals


def _clock_of(value: TimerColumn, times: Sequence[TimerColumn]) -> TimerColumn:
    """Return the times of a value: of its run and gate, else those nearest to its left."""
    beside = [clock for clock in times if clock.run in {value.run, ""} or not value.run] or times
    near = min(beside, key=lambda clock: (clock.at > value.at, abs(clock.at - value.at)))
    return next((clock for clock in beside if clock.gate and clock.gate == value.gate), near)


def _label_of(value: TimerColumn) -> str:
    """Return what the file calls an input: the heading of samples, or the gate's name in it."""
    is_named = value.role in VALUES[0] and value.gate in value.name
    return value.name if is_named or not value.gate else value.gate
