"""What each column of a timer's table is, and which times belong to which states or volts.

Facts are collected of each column (of its heading, its unit, its values), and the first rule of
`columns.txt` that they fulfil says what it is, or what it may be.
"""

import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial

from rig.text_rows import read_rows
from rig.timers import vocabulary
from rig.timers.table import Row, RowBlock
from rig.timers.timer_file import TimerFile
from rig.timers.vocabulary import POWERS, facts_held, find_label, form, kinds_of, unit_of

SAMPLED = ("level", "volts")
"""Roles of samples: what an input was at a time, whether it changed then or not."""
VALUES = (SAMPLED, ("state", "cleared"), ("edge",))
"""Roles that say what happened; of a table that has several, the first are read."""
_WIDEST = 200
_NO_ROLES = {"high", "low", "one", "zero", "unknown", "undefined", "missing", "gate letter"}
"""Of words that say nothing of a column: those of cells, and letters without a number."""
_MOST_OPEN = 3
"""Columns of which several roles are tried."""
_MANY = 4
"""Up to which columns are counted."""


@cache
def roles() -> dict[str, list[str]]:
    """Return of each role its meaning, a cell's form, what is accepted, and what 0 and 1 mean."""
    return {name: row for name, *row in read_rows(__file__, "roles.txt", " |")}


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
        Of times: decimal power from seconds, `None` where the file does not say their unit.
    gate, run
        Which input and which run all its values are of; empty where the heading does not say.
    clock, label
        Of what happened: which column says when, -1 for the number of the row, and what the file
        calls the input; empty where it does not say.
    state
        ``blocked`` or ``clear`` where the heading says what all its times did to the beam.
    packed
        Of inputs that are packed in a number: its base, 0 where it begins with ``0x`` or ``0b``,
        and which bit this input is.
    words
        What two unknown words mean, for which falls decide: the one that begins is ``high``.
    filled
        Share of the first rows that have a value.
    """

    at: int
    name: str
    role: str = ""
    power: int | None = 0
    gate: str = ""
    run: str = ""
    clock: int = -1
    label: str = ""
    state: str = ""
    packed: tuple[int, int] | None = None
    words: Mapping[str, str] = field(default_factory=dict)
    filled: float = 0.0

    def word(self, cell: str) -> str:
        """Return what a cell says: of packed inputs the bit, of times what their heading says."""
        with suppress(ValueError):
            return (
                str(int(cell, self.packed[0]) >> self.packed[1] & 1)
                if self.packed
                else (self.words.get(cell, cell) or self.state)
            )
        return cell

    def __str__(self) -> str:
        meaning = roles()[self.role][0]
        meaning += f" in {vocabulary.SYMBOLS[self.power]}" * (self.role == "time")
        high = "".join(f": {word!r} is high" for word in [*self.words][:1])
        return f"{self.name}: {meaning}{high}"


ROW_COUNT = TimerColumn(-1, "", "index")
"""Where rows have neither times nor numbers, they are counted."""


def columns_of(file: TimerFile, block: RowBlock, rows: Sequence[Row]) -> list[TimerColumn]:
    """Find out what the columns of a block are, in the way in which the file is read.

    Parameters
    ----------
    rows
        The first ones.

    Raises
    ------
    InputError
        Columns that are called as a setting is.
    """
    width = max(len(row.texts) for row in rows)
    if width > _WIDEST:
        file.problems.refuse(rows[0].line, "too_many_columns", columns=width, limit=_WIDEST)
    cells = {n: [text for row in rows if (text := row.cell(n))] for n in range(width)}
    facts = {n: _facts_of_values(texts) for n, texts in cells.items() if texts}
    counts = Counter(itertools.chain(*facts.values()))
    heading = block.find_heading(width)
    # What begins as a row, and has numbers, is a row of which nothing can be read.
    below = [row for row in block.headings if row.line > heading.line and not row.is_text]
    broken = [row.line for row in below if kinds_of(row.cell(0))]
    file.rows += len(broken)
    file.unread += broken
    if 0 < len(heading.texts) < width and "counts" in facts.get(0, ()):
        heading = heading._replace(texts=["", *heading.texts])  # numbers of rows have no name
    file.facts |= {"beam"} if "any.beam" in counts else set()
    shared = {f"table.{fact}" for fact in counts} | facts_held({"rated": block.find_time_base()[1]})
    shared |= {f"columns.{min(len(facts), _MANY)}", f"states.{min(counts['all.state'], _MANY)}"}
    columns = [
        column
        for n in facts
        # Beside named columns a few cells are none.
        if not heading.texts or heading.cell(n) or 2 * len(cells[n]) > len(rows)
        for column in _unpack(cells[n], n)
        or [_read_column(block, heading, n, facts[n] | shared, cells[n])]
    ]
    inputs = [column for column in columns if not heading.texts and column.role in SAMPLED]
    for column, name in zip(inputs, block.find_inputs(len(inputs)), strict=False):
        column.gate = column.name = name
    _settle_roles(file, columns)
    above, accepted = heading if heading.texts else rows[0], roles()["setting"][1]
    for column in columns:
        column.filled = len(cells[column.at]) / len(rows)
        # Falls decide whether a mark before the last three digits parts thousands.
        if column.power in {6, 9} and all(map(form("thousands").fullmatch, cells[column.at])):
            file.facts |= {mark := file.choose("decimals", "thousands")}
            column.power -= 3 * (mark == "thousands")
        if column.role == "setting":
            file.problems.reject(*above.place(column.at), "heading", column.name, accepted)
    file.problems.raise_if_any()
    return columns


def _unpack(cells: Sequence[str], at: int) -> list[TimerColumn]:
    """Return a column for each input where all are packed in a number; none in other columns.

    They are those bits of which one changes from row to row, each there and back.
    """
    for base in (0, 2, 16):
        with suppress(ValueError):
            changes = [a ^ b for a, b in itertools.pairwise(int(x, base) for x in cells) if a != b]
            bits = Counter(x.bit_length() - 1 for x in changes if x & (x - 1) == 0)
            if len(bits) > 1 and min(bits.values()) > 1 and bits.total() == len(changes):
                return [
                    TimerColumn(at, f"bit {n}", "level", gate=f"bit {n}", packed=(base, n))
                    for n in sorted(bits)
                ]
    return []


def _settle_roles(file: TimerFile, columns: Sequence[TimerColumn]) -> None:
    """Decide between roles that columns may have by those that others have.

    Of roles that are possible each is taken once; falls decide which way is that of the file.
    """
    there = Counter(column.role for column in columns)
    meant = {
        "elapsed": "duration" if "time" in there else "time",
        # Beside states the same without a name; beside volts, volts that are 0 at first.
        "level": next((role for role in ("volts", "state") if role in there), "level"),
    }
    unclear = [column for column in columns if "|" in column.role]
    readings = [column.role.split("|") for column in unclear]
    ways = [
        way
        for way in itertools.product(*readings if len(unclear) <= _MOST_OPEN else [[]])
        if max(((there + Counter(way))[role] for role in way if role != "other"), default=1) < 2
    ] or [("setting",) * len(unclear)]
    file.facts |= facts_held({"guess": ways[1:]})
    for column, role in zip(unclear, file.choose(*ways), strict=True):
        column.role = role
    for column in columns:
        column.role = meant.get(column.role, column.role)
    file.powers |= {column.power for column in columns if column.role == "time"}


def _read_column(
    block: RowBlock, heading: Row, n: int, facts: set[str], cells: Sequence[str]
) -> TimerColumn:
    """Find out what a column is; the row below its heading, or its cells, may say the unit."""
    name = heading.cell(n)
    above = [name, *(row.cell_over(n) for row in block.headings if row is not heading)]
    run, gate = (next(filter(None, [find_label(x, y) for x in above]), "") for y in ("run", "gate"))
    bare = vocabulary.without_accents(name)
    # Units stand in the heading, or in the row above the data.
    last = [row.cell(n) for row in block.headings[-1:] if name and row.line > heading.line]
    units = [*map(unit_of, [bare, *last, *cells[: "all.timed" in facts]])]
    unit = next((unit for unit in units if unit in {*POWERS, "v"}), units[0])
    is_numbers = form("row of numbers").fullmatch
    numbers = (row.cell(n) for row in block.headings if is_numbers(row.raw))
    gate = gate or next(numbers, "")
    roles_of_name = vocabulary.roles_in(bare.replace(find_label(bare, "run"), ""))
    named = {
        "time": unit in POWERS
        and vocabulary.normal(name).strip("()[] ") in vocabulary.words()[f"unit {unit}"],
        "bare": not (roles_of_name - _NO_ROLES or unit or gate or run),
        "named": name,
        "first": not n,
        "labelled": gate,
        "numbered": run,
    }
    kind = "timed" if unit in POWERS else {"v": "volt", "": "unitless"}.get(unit, "strange")
    facts |= roles_of_name | facts_held(named) | {kind}
    rules = read_rows(__file__, "columns.txt", ":")
    role = next(role for role, rule in rules if vocabulary.holds(rule, facts))
    is_time = "time" in role or role == "elapsed"
    power = POWERS.get(unit, 0 if "all.stamp" in facts else None) if is_time else 0
    state = next((x for x in ("clear", "blocked") if is_time and x in facts), "")
    is_pair = role == "edge" and {"pair", "all.state"} & facts == {"pair"}
    pair = zip(dict.fromkeys(cells), ("high", "low"), strict=False) if is_pair else ()
    name = name or f"column {n + 1}"
    return TimerColumn(n, name, role, power, gate, run, state=state, words=dict(pair))


def _facts_of_values(texts: Sequence[str]) -> set[str]:
    """Return what holds of the values of a column, of which some may be missing."""
    known = [*filter(kinds_of, texts)]
    texts = known if 2 * len(known) > len(texts) else texts  # a broken cell makes no other kind
    kinds, distinct = list(map(kinds_of, texts)), {*texts}
    facts = {f"all.{kind}" for kind in frozenset.intersection(*kinds)}
    facts |= {f"any.{kind}" for kind in frozenset().union(*kinds)}
    numbers = [*map(float, filter(vocabulary.is_number, texts))]
    steps = {b - a for a, b in itertools.pairwise(numbers)} if "all.number" in facts else {-1.0}
    steps -= {step for step in steps if step < -5e8}  # a counter begins anew
    is_rising = min(steps, default=0.0) >= 0.0 and steps != {0.0}
    return facts | facts_held(
        {
            "rises": is_rising,
            "climbs": is_rising and "any.fraction" in facts,
            "words": not numbers,
            "counts": steps == {1.0},
            "far": len(numbers) > 1 and abs(numbers[-1] - numbers[0]) > 100,
            "few": "all.whole" in facts and len(texts) >= 2 * len(distinct),
            "constant": len(distinct) == 1 < len(texts),
            "pair": len(distinct) == 2 and not re.search("[0-9]", "".join(distinct)),
            "many": len(texts) > 30,
        }
    )


def pair_columns(columns: Sequence[TimerColumn]) -> dict[TimerColumn, list[TimerColumn]]:
    """Give each column of times, or of numbers of samples, those that say what happened then.

    They are of its run and input. A column of times may tell of moments by itself.
    """
    counts = [column for column in columns if column.role == "index"][:1] or [ROW_COUNT]
    times = [column for column in columns if column.role == "time"]
    # Of columns that say the same times in other units, the finest is kept.
    coarse_first = sorted(times, key=lambda c: c.power or 0)
    finest = {(c.gate, c.run, c.state): c.power for c in coarse_first}
    times = [c for c in times if c.power == finest[c.gate, c.run, c.state]] or counts
    chosen = next((v for v in VALUES if any(c.role in v for c in columns)), ())
    nearest = {x: min(times, key=partial(_distance, x)) for x in columns if x.role in chosen}
    clocks = {clock: [x for x in nearest if nearest[x] is clock] for clock in times}
    for clock, signals in clocks.items():
        if not signals and chosen != SAMPLED:
            signals.append(replace(clock, at=ROW_COUNT.at, role="moment"))
        for n, signal in enumerate(signals, 1):
            signal.clock, signal.run = clock.at, clock.run or signal.run
            is_name = chosen == SAMPLED and signal.gate in signal.name and not signal.run
            label = signal.gate or clock.gate or signal.name * (len(signals) > 1)
            signal.label = signal.name if is_name else label
            if chosen == SAMPLED and signal.label in {x.label for x in signals[: n - 1]}:
                signal.label += f" ({n})"
    return {clock: signals for clock, signals in clocks.items() if signals}


def _distance(value: TimerColumn, clock: TimerColumn) -> tuple[bool, bool, bool, int]:
    """Return how far times are from a value: in run and gate, else by columns, nearest if left."""
    is_other_run = bool(value.run) and clock.run not in {value.run, ""}
    is_other_gate = not clock.gate or clock.gate != value.gate
    return is_other_run, is_other_gate, clock.at > value.at, abs(clock.at - value.at)
