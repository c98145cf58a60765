"""What each column of a timer's table is: by its heading, by its unit, and by its values."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

from rig.timers.table import count_known, is_number, is_value
from rig.timers.vocabulary import (
    POWERS,
    SYMBOLS,
    has_role,
    normal,
    number_of,
    state_of,
    unit_of,
    without_accents,
    words,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.timers.problems import ProblemList
    from rig.timers.table import Row, RowBlock, Table

_LOOKED_AT = 200  # rows
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


@dataclass(slots=True)
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
def _numbered(role: str) -> re.Pattern[str]:
    listed = "|".join(sorted(map(re.escape, words()[role]), key=len, reverse=True))
    return re.compile(
        rf"(?<![^\W\d_])(?:{listed})[\s#:_-]{{0,3}}(?:nr\.?|no\.?)?\s?(?:[0-9]{{1,4}}|[a-d])(?![^\W_])",
        re.IGNORECASE,
    )


def find_label(name: str, role: str) -> str:
    """Return the part of a heading that names an input, or a run, with its number."""
    match = _numbered(role).search(without_accents(name[:200]))
    return match[0] if match else ""


def columns_of(
    block: RowBlock, table: Table, unit: str | None, problems: ProblemList
) -> list[TimerColumn]:
    """Find out what the columns of a block are.

    Parameters
    ----------
    unit
        Of the times where the file does not say, a key of `POWERS`.
    problems
        Where it is noted, at its place, if that cannot be found out.
    """
    rows = [table.row(line) for line in block.rows[:_LOOKED_AT]]
    width = max(len(row.texts) for row in rows)
    values = [[text for row in rows if (text := row.cell(n))] for n in range(width)]
    heading = _find_heading(block, values)
    if heading is None:
        columns = _by_values(block, values, table, problems)
    else:
        columns = [
            _by_heading(block, heading, n, texts, table) for n, texts in enumerate(values) if texts
        ]
        _check(columns, heading, values, table, problems)
    for column in columns:
        if column.role == "time" and column.power is None:
            column.power = POWERS[unit] if unit else _plain_power(values[column.at])
    _leave_out_coarser(columns)
    return columns


def _find_heading(block: RowBlock, values: Sequence[list[str]]) -> Row | None:
    """Return the row with most cells that are known; above and below may stand symbols, units."""
    rows = [
        row
        for row in block.headings
        if count_known(row)
        and (len(row.texts) > 1 or len(values) == 1)
        and any(
            text and not is_number(text) and n < len(values) and values[n]
            for n, text in enumerate(row.texts)
        )
    ]
    return max(rows, key=lambda row: (count_known(row), len("".join(row.texts))), default=None)


def _by_heading(
    block: RowBlock, heading: Row, n: int, texts: Sequence[str], table: Table
) -> TimerColumn:
    full = heading.cell(n)
    prefix, colon, rest = full.partition(":")
    run = find_label(full, "run")
    name = full.replace(run, " ") if run else full
    if colon and rest.strip() and not find_label(prefix, "gate"):
        run, name = run or prefix.strip(), rest
    beside = [row.cell(n) for row in block.headings if row.line != heading.line]
    unit = unit_of(name)
    if unit not in {*POWERS, "v"}:
        rows = [row for row in block.headings if _has_units(row)]
        stated = (unit_of(row.cell(n).strip("()[] ")) for row in rows)
        unit = next((word for word in stated if word in {*POWERS, "v"}), unit)
    gate = next(filter(None, map(_find_gate, [name, *beside])), "")
    role = _role(name, unit, gate, texts, table)
    if role == "level" and len(texts) < min(len(block.rows), _LOOKED_AT):
        role = "state"  # of samples, each row has every level
    column = TimerColumn(n, full, role, gate=gate, run=run)
    if role == "time":
        column.power = POWERS.get(unit)
        if not unit and "_" not in name and normal(name) in POWERS:
            column.power = POWERS[normal(name)]
        clear = has_role(name, "clear")
        if clear or has_role(name, "blocked"):
            column.blocked = not clear
        counted = re.search(r"^\D{1,12}[0-9]{1,3}(?![0-9])", name.strip())
        column.numbered = counted is not None or has_role(name, "moment")
    return column


def _has_units(row: Row) -> bool:
    """Whether a row has units only, perhaps behind their name: ``Y_Unit_Label``."""
    texts = [normal(text.strip("()[] ")) for text in row.texts if text]
    units = set().union(*(listed for role, listed in words().items() if role.startswith("unit")))
    return len(texts) > 0 and all(
        text in units or (not n and "unit" in text) for n, text in enumerate(texts)
    )


def _find_gate(text: str) -> str:
    bare = re.fullmatch(r"\s*[0-9]{1,3}\s*", text[:20])
    return text.strip() if bare else find_label(text, "gate")


def _role(name: str, unit: str, gate: str, texts: Sequence[str], table: Table) -> str:
    """Return what a column is, by its heading, its unit and its values."""
    levels, timed = has_levels(texts), unit in POWERS
    fractions = any("." in text or "," in text for text in texts)
    darkens = has_role(name, "blocked") or has_role(name, "clear")
    is_time = has_role(name, "time") or (
        timed and normal(name).strip("()[] ") in words()[f"unit {unit}"]
    )
    rules = (
        ("index", has_role(name, "index") and counts(texts)),
        ("time", timed and not levels and (darkens or has_role(name, "moment"))),
        ("state", has_role(name, "state") and not timed),
        ("duration", has_role(name, "duration")),
        ("time", is_time and not levels and unit != "v"),
        ("time", timed and has_role(name, "gate") and not levels and rises(texts, table)),
        ("time", is_time and len(texts) < 3),
        ("edge", has_role(name, "edge") and levels and not gate),
        ("volts", unit == "v" or (has_role(name, "volts") and not (levels and gate))),
        ("volts", bool(gate) and fractions and not levels),
        (
            "level",
            bool(gate) and levels and not {state_of(t) for t in texts} & {"blocked", "clear"},
        ),
        ("state", bool(gate) and levels),
        ("run", has_role(name, "run") and not fractions),
        ("gate", has_role(name, "gate") and not fractions),
        ("index", has_role(name, "index") or counts(texts)),
        ("state", levels and darkens),
    )
    return next((role for role, fits in rules if fits), "other")


def _check(
    columns: Sequence[TimerColumn],
    heading: Row,
    values: Sequence[list[str]],
    table: Table,
    problems: ProblemList,
) -> None:
    """Refuse what may be this or that, and a table without times."""
    stated = any(column.role in {"edge", "state"} for column in columns)
    for column in columns:
        texts = values[column.at]
        place = heading.line, table.column(heading.line, column.at), column.name
        readings = ""
        if column.role == "gate" and not stated and set(texts) <= {"0", "1"}:
            readings = "a gate's number or its state"
        elif column.role == "other" and not has_role(column.name, "derived") and _is_few(texts):
            readings = "the gate or the run of a row, or its state"
        if readings:
            problems.add(*place, "ambiguous", column=column.name, readings=readings)
        named = unit_of(column.name)
        if column.role == "time" and named not in {*POWERS, ""} and not find_label(named, "gate"):
            problems.reject(*place[:2], "time", named, "a unit of time: s, ms, µs or ns")


def _by_values(
    block: RowBlock, values: Sequence[list[str]], table: Table, problems: ProblemList
) -> list[TimerColumn]:
    """Without a heading: a column of times, and others that can be nothing else."""
    first = block.rows[0]
    filled = [n for n, texts in enumerate(values) if texts]
    for row in block.headings:  # one that says nothing
        named = [n for n, text in enumerate(row.texts) if text and not is_value(text)]
        if named == filled and len(named) > 1:
            problems.add(row.line, table.column(row.line, 0), "", "no_time_column")
            return []
    rest = [n for n in filled if not counts(values[n]) or len(filled) == 1]
    times = [n for n in rest if not has_levels(values[n]) and rises(values[n], table)]
    fractional = [n for n in times if any(set(text) & set(".,") for text in values[n])]
    times = fractional if len(fractional) == 1 else times
    if len(filled) == 1 or (len(filled) == 2 and not times):
        times = filled[:1]  # whatever is wrong with it is said where it is read
    columns = [TimerColumn(n, f"column {n + 1}", _plain_role(n, values, times)) for n in filled]
    if len(filled) == 2 and len(block.rows) < 4 and times:
        for column in columns:
            column.role = "time" if column.at in times else "state"
    roles = [column.role for column in columns]
    if (
        "other" in roles
        or [roles.count(r) > 1 for r in ("time", "state", "gate")] != [False] * 3
        or ("time" not in roles)
    ):
        at = filled[min(2, len(filled) - 1)]
        problems.add(first, table.column(first, at), "", "no_heading", columns=len(filled))
    labels = [find_label(text, "gate") for row in block.headings for text in row.texts]
    for column in columns:
        column.power = None if column.role == "time" else 0
        if column.role == "volts":
            column.gate = next(filter(None, labels), "")
        # 0 and 1 beside a gate's number are levels: which of them is dark is not said.
        digits = {state_of(text) for text in values[column.at]} <= {"one", "zero", "high", "low"}
        if column.role == "state" and "gate" in roles and digits:
            column.role = "edge"
    return columns


def _plain_role(n: int, values: Sequence[list[str]], times: Sequence[int]) -> str:
    texts = values[n]
    rules = (
        ("time", n in times),
        ("index", counts(texts)),
        ("state", has_levels(texts)),
        ("gate", _is_few(texts) or not any(map(is_number, texts))),
        ("volts", len(texts) > 30),
    )
    return next((role for role, fits in rules if fits), "other")


def _leave_out_coarser(columns: Sequence[TimerColumn]) -> None:
    """Of columns that say the same times in other units, keep the finest."""
    finest: dict[tuple[str, str, bool | None], TimerColumn] = {}
    for column in (c for c in columns if c.role == "time" and not c.numbered):
        key = column.gate, column.run, column.blocked
        other = finest.setdefault(key, column)
        coarse = other if (column.power or 0) > (other.power or 0) else column
        if column.power != other.power and None not in {column.power, other.power}:
            coarse.role = "coarse"
            finest[key] = column if coarse is other else other


def as_float(text: str, table: Table) -> float:
    """Return a number."""
    return float(table.with_point(text))


def _plain_power(texts: Sequence[str]) -> int | None:
    """Return the power of times without a unit: fractions are seconds, and small whole numbers."""
    if not all(re.fullmatch(r"[+-]?[0-9]{1,30}", text) for text in texts):
        return 0
    return 0 if abs(int(texts[-1]) - int(texts[0])) <= 100 else None


def has_levels(texts: Sequence[str]) -> bool:
    """Whether a column holds two states, or levels, and nothing else."""
    return bool(texts) and all(state_of(text) or text.casefold() in {"x", "z"} for text in texts)


def _is_few(texts: Sequence[str]) -> bool:
    """Whether a column holds few different whole numbers, or names, again and again."""
    whole = [text for text in texts if number_of(text) is not None and not set(text) & set(".,+-")]
    return bool(texts) and len(whole) == len(texts) >= 2 * len(set(texts))


def counts(texts: Sequence[str]) -> bool:
    """Whether a column counts its rows."""
    if len(texts) < 2 or not all(re.fullmatch("[0-9]{1,9}", text) for text in texts):
        return False
    numbers = [int(text) for text in texts]
    return numbers[0] in {0, 1} and all(b - a == 1 for a, b in pairwise(numbers))


def rises(texts: Sequence[str], table: Table) -> bool:
    """Whether a column is of numbers of which none is below that before."""
    if not texts or not all(map(table.is_number, texts)):
        return False
    numbers = [as_float(text, table) for text in texts]
    return all(a <= b for a, b in pairwise(numbers))
