"""What each column of a timer's table is, and which times belong to which states or volts.

Facts are collected of each column (of its heading, its unit, its values), and the first rule of
`columns.txt` that they fulfil says what it is, or what it may be.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

from rig.timers import vocabulary
from rig.timers.vocabulary import POWERS, SYMBOLS, find_label, form, is_number, normal, words

if TYPE_CHECKING:
    from rig.timers.events import TimerFile
    from rig.timers.problems import ProblemList
    from rig.timers.table import Row, RowBlock

SAMPLED = ("level", "volts")
"""Roles of samples: what an input was at a time, whether it changed then or not."""
VALUES = (SAMPLED, ("state", "cleared"), ("edge",), ())
"""Roles that say what happened; of a table that has several, the first are read."""
_MOST_COLUMNS = 200
_BESIDE = 0.1
"""Share of the rows below which a column has settings that stand beside samples."""
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
    power, has_unit
        Of times: decimal power from seconds, `None` for counts of an unknown unit, and whether the
        file says it.
    gate, run
        Which input and which run all its values are of; empty where the heading does not say.
    state
        ``blocked`` or ``clear`` where the heading says what all its times did to the beam.
    numbered
        Whether it is one of times side by side: ``t1``, ``Stop 2``.
    """

    at: int
    name: str
    role: str = ""
    power: int | None = 0
    has_unit: bool = True
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


def columns_of(file: TimerFile, block: RowBlock, rows: Sequence[Row]) -> list[TimerColumn]:
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
        values = {"columns": width, "limit": _MOST_COLUMNS}
        file.problems.refuse(rows[0].line, 1, "too_many_columns", **values)
    if all(len(row.texts) != width for row in block.headings):
        # One without a heading has that of the block above.
        block.headings += [row for row in block.above if not row.is_mark]
    cells = {n: [text for row in rows if (text := row.cell(n))] for n in range(width)}
    facts = {n: _facts_of_values(texts, len(rows)) for n, texts in cells.items() if texts}
    heading = block.find_heading(facts, width)
    if heading is None:  # settings may stand beside samples
        beside = {n for n in facts if len(cells[n]) < _BESIDE * len(rows)}
        block.headings += [
            row._replace(texts=[t * (n in beside) for n, t in enumerate(row.texts)]) for row in rows
        ]
        facts = {n: fact for n, fact in facts.items() if n not in beside}
    table = {
        "single": len(facts) == 1,
        "rising": any({"rises", "fractions"} <= fact for fact in facts.values()),
        "listed": _is_each_row_rising(rows, width),
        "digital": all("levels" in fact for fact in facts.values()),
    }
    if table["digital"]:
        table["rated"] = block.find_time_base() is not None
    shared = {fact for fact, holds in table.items() if holds}
    columns = [_read_heading(block, heading, n, fact | shared) for n, fact in facts.items()]
    if heading is None:
        inputs = [column for column in columns if column.role in SAMPLED]
        count = [f"D{n}" for n, column in enumerate(inputs) if column.role == "level"]
        names = block.find_inputs([column.at for column in inputs]) or count
        for column, name in zip(inputs, names, strict=False):
            column.gate = column.name = name
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
    for column in columns:
        if column.role == "time" and not column.has_unit:
            file.has_unit, file.is_counted = False, file.is_counted or column.power is None
    _check_columns(columns, heading, rows[0], file.problems)
    return columns


def _is_each_row_rising(rows: Sequence[Row], width: int) -> bool:
    """Whether each row is a list of times, one after the other, as programs print them."""
    numbers = [[float(text) for text in row.texts if is_number(text)] for row in rows]
    is_list = all(len(row) == width and sorted(set(row)) == row for row in numbers)
    return width >= _FEWEST_TIMES and is_list


def _check_columns(
    columns: Sequence[TimerColumn], heading: Row | None, first: Row, problems: ProblemList
) -> None:
    """Refuse columns without a heading that may be something else, and units that are none."""
    counts, above = Counter(column.role for column in columns), heading or first
    repeated = max(counts["state"], counts["edge"], counts["gate"]) > 1
    # Two traces of an oscilloscope stand beside each other, each with its times.
    is_timed = counts["time"] in {1, counts["volts"] or 1} or counts["level"] > 0
    is_listed = all(column.numbered for column in columns)
    if heading is None and (repeated or counts["other"] or not (is_timed or is_listed)):
        place = first.place(columns[min(2, len(columns) - 1)].at)
        problems.add(*place, "", "no_heading", columns=len(columns))
    for column in columns if heading else ():
        place, unit = above.place(column.at), vocabulary.unit_of(column.name)
        if column.role == "setting" or "|" in column.role:
            values = {"column": column.name, "readings": column.meaning}
            problems.add(*place, column.name, "ambiguous", **values)
        elif column.role == "time" and unit not in {*POWERS, ""} and not find_label(unit, "gate"):
            problems.reject(*place, "time", unit, "a unit of time: s, ms, µs or ns")
    if not counts.keys() & {"time", *SAMPLED}:
        durations = ", ".join(repr(column.name) for column in columns if column.role == "duration")
        code = "durations" if durations else "no_time_column"
        problems.add(above.line, 1, "", code, numbers=durations)
    problems.raise_if_any()


def _read_heading(block: RowBlock, heading: Row | None, n: int, facts: set[str]) -> TimerColumn:
    """Find out what a column is by its heading; the other rows above it may say unit or gate."""
    name = heading.cell(n) if heading else ""
    column = TimerColumn(n, name or f"column {n + 1}", run=find_label(name, "run"))
    name = name.replace(column.run, " ") if column.run else name
    prefix, colon, rest = name.partition(":")
    if colon and rest.strip() and not find_label(prefix, "gate"):
        column.run, name = column.run or prefix.strip(), rest
    units = [name, *(row.cell(n) for row in reversed(block.headings) if row.has_units)]
    units = [vocabulary.unit_of(text) for text in units]
    unit = next((unit for unit in units if unit in {*POWERS, "v"}), units[0])
    labels = (find_label(text, "gate") for text in (name, *(r.cell(n) for r in block.headings)))
    numbers = (row.cell(n) for row in block.headings if row.has_numbers)
    column.gate = next(filter(None, itertools.chain(labels, numbers)), "")
    is_bare_unit = unit in POWERS and normal(name).strip("()[] ") in words()[f"unit {unit}"]
    facts = facts | vocabulary.roles_in(name) | ({"time"} if is_bare_unit else set())
    facts |= {"timed"} if unit in POWERS else {{"v": "volt", "": "unitless"}.get(unit, "")}
    facts |= set() if heading and (heading.line or heading.cell(n)) else {"bare"}
    facts |= {"labelled"} if column.gate else set()
    facts |= {"numbered"} if column.run else set()
    column.role = next(
        role
        for role, rule in vocabulary.read_rows("columns.txt", ":")
        if all((fact.lstrip("-") in facts) is (fact[0] != "-") for fact in rule.split())
    )
    if column.role == "time":
        power = POWERS.get(unit if unit or "_" in name else normal(name))
        column.has_unit = power is not None or "suffixed" in facts
        # Fractions are seconds, and so are small whole numbers.
        column.power = power if power is not None or "counted" in facts else 0
        column.state = next((state for state in ("clear", "blocked") if state in facts), "")
        column.numbered = bool({"moment", "listed"} & facts)
    return column


def _facts_of_values(texts: Sequence[str], rows: int) -> set[str]:
    """Return what holds of the values of a column, of which some may be missing."""
    kinds = [vocabulary.kinds_of(text) for text in texts]
    numbers = [float(text) for text in texts if is_number(text)]
    is_whole = all(vocabulary.number_of(t) is not None and not set(t) & set(".,+-") for t in texts)
    steps, is_numeric = {b - a for a, b in itertools.pairwise(numbers)}, len(numbers) == len(texts)
    is_count = all(form("count").fullmatch(text) for text in texts)
    facts = {
        "levels": all("state" in kind for kind in kinds),
        "suffixed": all({"timed", "clock"} & kind for kind in kinds),
        "plain": not any({"blocked", "clear"} & kind for kind in kinds),
        "fractions": any("." in text or "," in text for text in texts),
        "rises": is_numeric and min(steps, default=0.0) >= 0.0,
        "counts": is_numeric and is_whole and numbers[0] in {0, 1} and steps == {1.0},
        "counted": is_count and abs(int(texts[-1]) - int(texts[0])) > 100,
        "few": is_whole and len(texts) >= 2 * len(set(texts)),
        "bits": set(texts) <= {"0", "1"},
        "words": not numbers,
        "short": len(texts) < 3,
        "many": len(texts) > 30,
        "gaps": len(texts) < rows,
    }
    return {fact for fact, holds in facts.items() if holds}


def find_signals(columns: Sequence[TimerColumn]) -> list[Signal]:
    """Give each column of times the values that belong to it: of its run, and of its input."""
    chosen = ([c for c in columns if c.role in listed] for listed in VALUES)
    values = next(filter(None, chosen), [])
    counts = [column for column in columns if column.role == "index"][:1] or [ROW_COUNT]
    times = [column for column in columns if column.role == "time"] or counts
    is_sampled = any(value.role in SAMPLED for value in values)
    signals = []
    for clock in times:
        own = [value for value in values if _clock_of(value, times) is clock]
        is_only = all(other is clock or other.run != clock.run for other in times)
        named = Counter(map(_label_of, own))
        for n, value in enumerate(own, 1):
            is_beside = is_sampled or len(own) > 1
            label = _label_of(value) if is_beside else clock.gate or value.gate * (not is_only)
            label += f" ({n})" if is_sampled and named[label] > 1 else ""
            signals.append(Signal(clock, value, clock.run or value.run, label))
        if not own and not is_sampled:
            is_lone = sum(other.gate == clock.gate for other in times) == 1
            is_named = is_lone and clock.gate in clock.name and not (clock.run or clock.state)
            label = clock.name if clock.gate and is_named else clock.gate
            signals.append(Signal(clock, None, clock.run, label))
    return signals


def _clock_of(value: TimerColumn, times: Sequence[TimerColumn]) -> TimerColumn:
    """Return the times of a value: of its run and gate, else those nearest to its left."""
    beside = [clock for clock in times if clock.run in {value.run, ""} or not value.run] or times
    near = min(beside, key=lambda clock: (clock.at > value.at, abs(clock.at - value.at)))
    return next((clock for clock in beside if clock.gate and clock.gate == value.gate), near)


def _label_of(value: TimerColumn) -> str:
    """Return what the file calls an input: the heading of samples, or the gate's name in it."""
    is_named = value.role in SAMPLED and value.gate in value.name
    return value.name if is_named or not value.gate else value.gate
