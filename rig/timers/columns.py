"""What each column of a timer's table is: by its heading, by its unit, and by its values.

Facts are collected of each column, and the first rule of `columns.txt` that they fulfil says what
it is. The project's own format has columns that are known beforehand.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

from rig.timers.table import HEADER, Row, count_known, find_time_base
from rig.timers.vocabulary import (
    POWERS,
    SYMBOLS,
    find_label,
    has_role,
    is_number,
    normal,
    number_of,
    read_rows,
    state_of,
    unit_of,
    words,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from rig.timers.problems import ProblemList
    from rig.timers.table import RowBlock, Table

_MEANINGS = {
    "state": "states, blocked or clear",
    "duration": "durations, not used",
    "edge": "edges, up or down",
    "volts": "volts, or light",
    "level": "levels of an input",
    "run": "run",
    "gate": "which gate",
    "index": "counts rows, not used",
    "coarse": "the same times, coarser; not used",
}


_FEWEST_TIMES = 4
"""Columns, each later than the one before, that are times side by side."""


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
        A key of `_MEANINGS`, ``time``, or ``other``.
    power
        Of times: decimal power from seconds; `None` where the file does not say it.
    gate, run
        Which input and which run all its values are of; empty where the heading does not say.
    blocked
        What all its times did to the beam, where the heading says it.
    numbered
        Whether it is one of times side by side: ``t1``, ``Stop 2``.
    """

    at: int
    name: str
    role: str
    power: int | None = 0
    gate: str = ""
    run: str = ""
    blocked: bool | None = None
    numbered: bool = False

    @property
    def meaning(self) -> str:
        """What it was taken for, in words."""
        if self.role == "time":
            return "times in " + ("an unknown unit" if self.power is None else SYMBOLS[self.power])
        return _MEANINGS.get(self.role, "not used")


@cache
def _rules() -> list[tuple[str, set[str], set[str]]]:
    rows = [(role, facts.split()) for role, facts in read_rows("columns.txt", ":")]
    return [
        (role, {f for f in facts if f[0] != "-"}, {f[1:] for f in facts if f[0] == "-"})
        for role, facts in rows
    ]


def _find_role(facts: set[str]) -> str:
    fitting = (role for role, needed, barred in _rules() if needed <= facts and not barred & facts)
    return next(fitting, "other")


def columns_of(
    block: RowBlock, rows: Sequence[Row], table: Table, unit: str | None, problems: ProblemList
) -> list[TimerColumn]:
    """Find out what the columns of a block are.

    Parameters
    ----------
    rows
        The first ones.
    unit
        Of the times where the file does not say, a key of `POWERS`.
    problems
        Where it is noted, at its place, if that cannot be found out.
    """
    if table.is_own:
        roles = ("run", "gate", "time", "state")
        return [TimerColumn(n, name, roles[n]) for n, name in enumerate(HEADER)]
    width = max(len(row.texts) for row in rows)
    cells = [[text for row in rows if (text := row.cell(n))] for n in range(width)]
    facts = {n: _facts_of_values(texts) for n, texts in enumerate(cells) if texts}
    heading = _find_heading(block, facts, width)
    if all("levels" in fact for fact in facts.values()):
        heading = _name_levels(len(facts), block, table) or heading
    if heading is None and _is_each_row_rising(rows, width):
        heading = Row(0, [f"moment {n}" for n in range(1, width + 1)])
    bare = set() if heading else {"bare", *({"single"} if len(facts) == 1 else set())}
    is_rising = [n for n, fact in facts.items() if {"rises", "fractions"} <= fact - {"levels"}]
    for fact in facts.values():
        fact.update(bare, {"rival"} if is_rising and "fractions" not in fact else ())
    columns = [_read_heading(block, heading or Row(0, []), n, fact) for n, fact in facts.items()]
    if heading is None:
        _check_bare(block, columns, rows[0], problems)
    for column in columns:
        texts = cells[column.at]
        if column.role == "level" and len(texts) < len(rows):
            column.role = "state"  # of samples, each row has every level
        if column.role == "time" and column.power is None:
            column.power = POWERS[unit] if unit else _plain_power(texts)
        if heading:
            _check(column, columns, heading, facts[column.at], problems)
    # Of columns that say the same times in other units, the finest is kept.
    times = [c for c in columns if c.role == "time" and not c.numbered and c.power is not None]
    for column in times:
        key = column.gate, column.run, column.blocked
        alike = [c.power or 0 for c in times if (c.gate, c.run, c.blocked) == key]
        if (column.power or 0) < max(alike):
            column.role = "coarse"
    return columns


def _is_each_row_rising(rows: Sequence[Row], width: int) -> bool:
    """Whether each row is a list of times, one after the other, as programs print them."""
    numbers = [[float(text) for text in row.texts if is_number(text)] for row in rows]
    return width >= _FEWEST_TIMES and all(
        len(row) == width and sorted(set(row)) == row for row in numbers
    )


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
    at = [column.at for column in columns]
    counts = Counter(column.role for column in columns)
    repeated = max(counts["state"], counts["edge"], counts["gate"]) > 1
    # Two traces of an oscilloscope stand beside each other, each with its times.
    if repeated or counts["other"] or counts["time"] not in {1, counts["volts"] or 1}:
        place = first.column(at[min(2, len(at) - 1)])
        problems.add(first.line, place, "", "no_heading", columns=len(at))
    texts = sorted((n, text) for row in block.headings for n, text in enumerate(row.texts))
    labels = [(n, label) for n, text in texts if (label := find_label(text, "gate"))]
    traces = list(zip([c for c in columns if c.role == "volts"], labels, strict=False))
    # Settings name traces if each name is equally far to the left of its trace.
    is_named = len({trace.at - n for trace, (n, _) in traces}) == 1
    for trace, (_, label) in traces:
        trace.gate = label if is_named else ""


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
        and not any(text and not _is_setting(text) for text in row.texts[width:])
        and not any(is_number(text) and not text.isdecimal() for text in row.texts[:width])
    ]
    return max(rows, key=lambda row: (count_known(row), len("".join(row.texts))), default=None)


def _is_setting(text: str) -> bool:
    return is_number(text) or any(has_role(text, role) for role in ("start", "step", "rate"))


def _read_heading(block: RowBlock, heading: Row, n: int, facts: set[str]) -> TimerColumn:
    """Find out what a column is by its heading; the other rows above it may say unit or gate."""
    name, beside = heading.cell(n), [r.cell(n) for r in block.headings if r.line != heading.line]
    prefix, colon, rest = name.partition(":")
    column = TimerColumn(n, name or f"column {n + 1}", "", run=find_label(name, "run"))
    name = name.replace(column.run, " ") if column.run else name
    if colon and rest.strip() and not find_label(prefix, "gate"):
        column.run, name = column.run or prefix.strip(), rest
    below = [row.cell(n).strip("()[] ") for row in block.headings if _has_units(row)]
    units = [unit_of(text) for text in (name, *below)]
    unit = next((unit for unit in units if unit in {*POWERS, "v"}), units[0])
    column.gate = next(filter(None, map(_find_gate, [name, *beside])), "")
    facts = facts | {role for role in words() if has_role(name, role)}
    kinds = dict.fromkeys(POWERS, "timed") | {"v": "volt", "": "unitless"}
    facts |= {kinds.get(unit, ""), "labelled" * bool(column.gate), "numbered" * bool(column.run)}
    if unit in POWERS and normal(name).strip("()[] ") in words()[f"unit {unit}"]:
        facts |= {"time"}
    column.role = _find_role(facts)
    if column.role == "time":
        column.power = POWERS.get(unit if unit or "_" in name else normal(name))
        column.blocked = False if "clear" in facts else True if "blocked" in facts else None
        counted = re.search(r"^\D{1,12}[0-9]{1,3}(?![0-9])", name.strip())
        column.numbered = counted is not None or "moment" in facts
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


def _check(
    column: TimerColumn,
    columns: Sequence[TimerColumn],
    heading: Row,
    facts: set[str],
    problems: ProblemList,
) -> None:
    """Refuse what may be this or that, and times in another unit."""
    readings, place = "", (heading.line, heading.column(column.at))
    stated = any(other.role in {"edge", "state"} for other in columns)
    if column.role == "gate" and not stated and "binary" in facts:
        readings = "a gate's number or its state"
    elif column.role == "other" and "few" in facts and not has_role(column.name, "derived"):
        readings = "the gate or the run of a row, or its state"
    elif column.role == "other" and _is_setting(column.name):
        readings = "a setting of the file or a signal"
    if readings:
        problems.add(*place, column.name, "ambiguous", column=column.name, readings=readings)
    unit = unit_of(column.name)
    if column.role == "time" and unit not in {*POWERS, ""} and not find_label(unit, "gate"):
        problems.reject(*place, "time", unit, "a unit of time: s, ms, µs or ns")


def _plain_power(texts: Sequence[str]) -> int | None:
    """Return the power of times without a unit: fractions are seconds, and small whole numbers."""
    if not all(re.fullmatch(r"[+-]?[0-9]{1,30}", text) for text in texts):
        return 0
    return 0 if abs(int(texts[-1]) - int(texts[0])) <= 100 else None


def _facts_of_values(texts: Sequence[str]) -> set[str]:
    states = [state_of(text) or text.casefold() in {"x", "z"} for text in texts]
    numbers = [float(text) for text in texts if is_number(text)]
    ints = [text for text in texts if number_of(text) is not None and not set(text) & set(".,+-")]
    steps = {b - a for a, b in pairwise(numbers)}
    is_numeric = len(numbers) == len(texts)
    facts = {
        "levels": len(texts) > 0 and all(states),
        "plain": not {"blocked", "clear"} & set(states),
        "fractions": any("." in text or "," in text for text in texts),
        "rises": is_numeric and all(step >= 0 for step in steps),
        "counts": is_numeric and len(ints) == len(texts) > 1 and numbers[0] in {0, 1}
        and steps == {1.0},
        "few": len(ints) == len(texts) >= 2 * len(set(texts)),
        "binary": set(texts) <= {"0", "1"},
        "words": not numbers,
        "short": len(texts) < 3,
        "many": len(texts) > 30,
    }  # fmt: skip
    return {fact for fact, holds in facts.items() if holds}
