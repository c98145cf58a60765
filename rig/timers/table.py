"""A text file as blocks of rows: cells below a preamble of headings, units, remarks and settings.

How the lines of a file are written (cells parted by a separator, or values between words) is found
out from its first lines; then lines are read one after the other, and none is kept. A setting is a
name with its value behind ``:`` or ``=``, in the next cell or below it.
"""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

from rig.text_rows import read_rows
from rig.timers import vocabulary
from rig.timers.vocabulary import LONGEST, form, is_measured, is_number, kinds_of, roles_in

_Shape = tuple[tuple[bool, bool], ...]
"""Of each cell whether it is filled, and a number."""
_Name = tuple[str, int]
"""Words before a value, and how many values with the same are before it in its line."""
_NO_ROLES = {"derived", "index"}
"""Of columns that any table may have."""
_ROLES = _NO_ROLES | {"time", "elapsed", "state", "edge", "volts", "gate", "run", "duration"}
"""Those that columns may have."""
_Lines = Iterable[tuple[int, str]]
"""Lines of a file with their numbers."""
_RATES = {"hz": 0, "khz": -3, "mhz": -6, "ghz": -9, "s/s": 0, "ks/s": -3, "ms/s": -6, "gs/s": -9}
_UNITS = vocabulary.POWERS | {"": 0} | _RATES
"""Decimal power from seconds, or from hertz."""
_JUDGED = 100
"""Lines in which values are counted."""
_SAMPLE = 500
"""Lines that show how a file is written; without a row among them it is no table."""


@dataclass(eq=False, slots=True)
class RowBlock:
    """What stands above rows that stand together.

    Attributes
    ----------
    remarks
        Of the whole file, as far as read.
    above
        Headings of the block before.
    number
        How many are before it that have no mark of a run or of a gate.
    run, gate
        Which all its rows are of; empty where no mark says so.
    headings
        Its own, without such marks.
    width
        How many cells the first row has.
    """

    remarks: list[Row] = field(default_factory=list)
    above: list[Row] = field(default_factory=list)
    number: int = 0
    run: str = ""
    gate: str = ""
    headings: list[Row] = field(default_factory=list)
    width: int = 0

    def begin(self, width: int) -> None:
        """Begin its rows: one without a heading as wide as these has that of the block above."""
        if not (self.width or any(len(x.texts) == width and x.is_text for x in self.headings)):
            self.headings += self.above
        self.width = self.width or width

    def begin_below(self, mark: str, *headings: Row) -> RowBlock:
        """Begin the block below a mark; a run or gate goes on until a mark names another."""
        run, gate = (vocabulary.find_label(mark, role) for role in ("run", "gate"))
        above = self.headings if self.width else [*self.above, *self.headings][:_SAMPLE]
        number = self.number + (not run and not gate)
        run, gate = run or self.run, gate or self.gate
        return RowBlock(self.remarks, above, number, run, gate, [*headings])

    def find_heading(self, width: int) -> Row:
        """Return the row with most cells that are known, the lowest of those with most names.

        Above and below may stand symbols, units and settings.
        """
        # Rows may end with a separator.
        ranks = [
            (row.count_known(), len({*row.texts}), row.line, row)
            for row in self.headings or self.remarks
            if len(row.texts) > width - 2 + (not self.headings) and row.is_text
        ]
        return max(ranks)[-1] if any(rank[0] for rank in ranks) else Row(0, [])

    def find_time_base(self) -> tuple[float, float]:
        """Return the first sample's time and the step, s, that settings state; 0 without."""
        stated, rows = dict[str, float](), [*self.remarks, *self.headings, Row(0, [])]
        texts = [
            f"{text} {value}"[:LONGEST]
            for above, below in itertools.pairwise(rows)
            for n, text in enumerate(above.texts)
            for value in ("", above.cell(n + 1), below.cell(n))
        ]
        for name, number, symbol in form("stated value").findall("\n".join(texts)):
            unit = re.split("[ _]", symbol or name)[-1].lower().replace("sa/", "s/")
            power = _UNITS.get(unit, _UNITS.get(vocabulary.unit_of(symbol)))
            if power is not None:
                # What is in hertz is a rate, whatever its name, if no other is.
                roles = roles_in(name) - {"step"} | {"hertz"} if unit in _RATES else roles_in(name)
                value = float(number.replace(",", ".")) / 10.0**power
                stated = dict.fromkeys(roles, value) | stated
        rate = stated.get("rate") or stated.get("hertz") or math.inf
        return stated.get("start", 0.0), stated.get("step") or 1.0 / rate

    def find_inputs(self, count: int) -> list[str]:
        """Return names of inputs without a heading: those of a row that lists as many."""
        named = (form("gate label").findall(row.raw) for row in [*self.remarks, *self.headings])
        # A number may be taken for that of a gate.
        return next((x for x in named if len(x) == count), [*"ABCDEFGHIJKLMNOPQRSTUVWXYZ"])


class Row(NamedTuple):
    """A line: its number, from 1, what its cells say, how it was written, and its block."""

    line: int
    texts: list[str]
    raw: str = ""
    block: RowBlock = RowBlock()

    def cell(self, at: int) -> str:
        """Return what a column, from 0, has; nothing where the row has no such."""
        return self.texts[at] if 0 <= at < len(self.texts) else ""

    def cell_over(self, at: int) -> str:
        """Return what stands over a column: of merged cells only the first has a text.

        The last of them is as wide as the widest other; what is beyond belongs to none.
        """
        filled = [n for n, text in enumerate(self.texts) if text]
        width = max((b - a for a, b in itertools.pairwise(filled)), default=0)
        return next(filter(None, self.texts[max(0, at + 1 - width) : at + 1][::-1]), "")

    def count_known(self) -> int:
        """Count the cells that say what a column is."""
        roles = [{*(roles_in(x) & _ROLES), vocabulary.unit_of(x)} - {""} for x in self.texts]
        is_heading = set().union(*roles) - _NO_ROLES and "units" not in roles_in(self.texts[0])
        return sum(map(bool, roles)) if is_heading else 0

    @property
    def is_text(self) -> bool:
        """Whether it may name columns: without measured numbers but those of inputs behind a time.

        A remark does so with most of its cells, and states nothing.
        """
        if vocabulary.is_remark(self.raw) and (
            len(self.texts) >= 2 * self.count_known() or form("assignment").search(self.raw)
        ):
            return False
        is_numbers = form("time and numbers").fullmatch
        return not any(map(is_measured, self.texts)) or is_numbers(self.raw) is not None

    @property
    def is_mark(self) -> bool:
        """Whether it says that another run, or gate, begins: ``--- Run 2 ---``."""
        return form("mark").fullmatch(vocabulary.normal(" ".join(self.texts))) is not None

    @property
    def is_heading(self) -> bool:
        """Whether it stands above its block again, or has no numbers and is known by half."""
        return self.is_text and (
            self.texts in [row.texts for row in self.block.headings]
            or 0 < len(self.texts) <= 2 * self.count_known()
        )

    def place(self, at: int) -> tuple[int, int]:
        """Return the line, and the column, from 1, at which a cell begins; 1 without the cell."""
        column, end, raw = 1, 0, self.raw.replace(",", ".")
        for text in self.texts[: at + 1] if at < len(self.texts) else []:
            column = 1 + max(end, raw.find(text.replace(",", "."), end))
            end = column + len(text)
        return self.line, column


class Table:
    """A text file of rows.

    Parameters
    ----------
    lines
        All of them, one after the other, with their numbers.
    choose
        Returns which of several answers is tried where lines leave a question open.

    Attributes
    ----------
    separator
        Of the cells; a blank stands for any number of blanks, nothing for words between values.
    strays, words
        Lines among rows that are neither rows nor headings: with a value, or without.
    """

    def __init__(self, lines: _Lines, choose: Callable[..., str]) -> None:
        self.strays, self.words = list[int](), list[int]()
        lines = _split_lists((number, _unwrap(line)) for number, line in lines)
        head = [*itertools.islice(lines, _SAMPLE)]
        names, named = _find_names(_plain(head))
        self.separator = choose(*find_separators(_plain(head), named))
        self._names = [] if self.separator else [name for name, _ in names]
        chained = itertools.chain(head, lines)
        lines = chained if self.separator else _tabulate(chained, names)
        head = [*itertools.islice(lines, _SAMPLE)]
        self._lines = (x for x in itertools.chain(head, lines) if x[1].strip(" \t,;|"))
        self._usual = _Shape()
        shapes = Counter(x for x in map(_shape, map(self.split, _plain(head))) if any(map(all, x)))
        usual, count = next(iter(shapes.most_common(1)), ((), 0))
        self._usual = usual if 2 * count > max(2, shapes.total()) else ()

    def split(self, line: str) -> list[str]:
        """Split a line into cells; numbers get a decimal point, and what is missing is empty."""
        return [*map(_read_cell, split_cells(line, self.separator or "\t", self._usual))]

    def rows(self) -> Iterator[Row]:
        """Yield each row of data."""
        block, is_plain = RowBlock(), form("plain row").fullmatch
        block.headings += [Row(1, self._names)] if self._names else []
        for number, line in self._lines:
            if block.width and is_plain(line):  # as most
                yield Row(number, self.split(line), line, block)
                continue
            mark = form("remark").match(line[:LONGEST])
            text = line[mark.end() :].rstrip('" ') if mark else line
            row = Row(number, self.split(text), line, block)
            if row.is_mark or (block.width and form("rule").fullmatch(line)):
                block = block.begin_below(line)
            elif not mark and self._is_row(row):
                block.begin(len(row.texts))
                yield row
            elif mark:
                block.remarks += [row] * (not block.width and number <= _SAMPLE)
            elif not block.width:
                if len(block.headings) > _SAMPLE:
                    return
                block.headings.append(row)
            elif row.is_heading:
                block = block.begin_below("", row)
            elif any(row.texts):
                (self.strays if any(map(kinds_of, row.texts)) else self.words).append(number)

    def _is_row(self, row: Row) -> bool:
        """Whether it is as most rows, or has values only, and at least a number or a time.

        Above rows of several cells may stand a date, or a count. A row of data with a fault is as
        wide as those above, or as their names.
        """
        texts = row.texts
        if _begins_as(texts, self._usual):  # as most, perhaps with words behind
            return True
        if (len(texts) > 1 or len(self._usual) < 2) and all(map(kinds_of, filter(None, texts))):
            return any(map(is_measured, texts))
        above = (x.texts for x in row.block.headings if len(x.texts) == x.count_known())
        is_wide = len(texts) in {row.block.width, *map(len, above)} and any(map(is_number, texts))
        return is_wide and not roles_in(texts[0]) & vocabulary.TIME_BASE


def split_cells(line: str, separator: str, usual: _Shape = ()) -> list[str]:
    """Split a line into cells, without the blanks and the quotes around them."""
    quote = "'" if line.lstrip()[:1] == "'" else '"'
    if quote in line or separator != " ":
        reader = csv.reader([line], delimiter=separator, quotechar=quote, skipinitialspace=True)
        cells = next(reader, [])
    else:
        # A heading has names of several words: two blanks or more part them.
        cells = [word.strip(":") for word in line.split()]
        is_row = len(cells) == len(usual) or _begins_as(cells, usual) or all(map(kinds_of, cells))
        cells = cells if is_row else re.split(r" {2,}|\t", line.strip())
    return [text.strip().strip('"').strip() for text in cells]


@lru_cache(10_000)
def _read_cell(text: str) -> str:
    """Return a cell in which a number has a decimal point and no mark of thousands."""
    if text[:5].casefold() in vocabulary.words()["missing"]:
        return ""
    if form("grouped").fullmatch(text[:LONGEST]):
        text = form("mark of thousands").sub("", text)
    return text.replace(",", ".") if form("decimal comma").fullmatch(text[:LONGEST]) else text


@lru_cache(10_000)
def _unwrap(line: str) -> str:
    """Return a line without what `markup.txt` says to be none of its values or names."""
    if form("marked up").search(line):  # as few are
        for expression, text in read_rows(__file__, "markup.txt", "=>"):
            line = form(expression).sub(text, line)
    return line


def _split_lists(lines: _Lines) -> Iterator[tuple[int, str]]:
    """Make a line of what stands between brackets, be it in a line or over several.

    A list has its name before it, that of a run or of a gate as a mark above it; an object with a
    name is part of what it stands in.
    """
    number, text, levels = 0, "", list[bool]()
    for number, line in lines:
        if vocabulary.is_remark(line) or not (levels or form("list").match(line)):
            yield number, line
            continue
        if len(text) > 100 * LONGEST:  # a bracket that nothing closes
            levels.clear()
        for piece in (*form("piece of a list").findall(line), " "):
            is_part = piece not in ({";", "; "} if levels else {" "})
            if piece[-1] in "[({":
                name = text[-LONGEST:].rstrip()
                is_part = name.endswith((":", "=")) and not form("matrix").match(line)
                levels.append(is_part and piece == "{")
                is_part &= not any(vocabulary.find_label(name, x) for x in ("run", "gate"))
            elif piece in {"]", ")", "}"}:
                is_part = bool(levels) and levels.pop()
            if not is_part:
                yield number, text.strip(" ,;").replace('"', "")
            text = (text.rstrip(" :=") + ", " if piece == "[" else text + piece) * is_part
    yield number, text


def _named_values(line: str) -> list[tuple[_Name, str]]:
    """Return the values between the words of a line, each with the words right before it."""
    values, end, counts = [], 0, Counter[str]()
    for match in form("value").finditer(line[:LONGEST]):
        named = form("value name").search(line[end : match.start()])
        name = named[1].strip() if named else ""
        values.append(((name, counts[name]), match[0].replace(",", ".")))
        counts[name] += 1
        end = match.end()
    return values


def _find_names(lines: Sequence[str]) -> tuple[list[_Name], int]:
    """Return what most lines name before their values, and how many values they name so.

    Of records over several lines, of which each names a value, it is what these name.
    """
    rows = Counter(tuple(dict(_named_values(line))) for line in lines[-_JUDGED:])
    del rows[()]
    usual, most = next(iter(rows.most_common(1)), ((), 0))
    fields = [x for x, n in rows.items() if x[0][0] and not x[1:] and 2 * n >= most > 1]
    is_named = any(name[1:] for name, _ in usual) and 2 * most > rows.total()
    fields = fields if len(fields) > 1 else [usual] * is_named
    return [*itertools.chain(*fields)], sum(len(x) * rows[x] for x in fields)


def _tabulate(lines: _Lines, names: Collection[_Name]) -> Iterator[tuple[int, str]]:
    """Make cells of values between words, of a line or of several that have one each.

    A record ends before a name that comes again, or where all have come.
    """
    times = Counter(name for name, _ in names)
    record, at, is_row = dict[_Name, str](), 0, False
    for number, line in itertools.chain(lines, [(0, "")]):
        values = _named_values(line)
        if times.keys().isdisjoint(name for (name, _), _ in values):
            # Of a line that begins in its middle
            values = [((name.split(" ")[-1], n), text) for (name, n), text in values]
        cells = [((x, n % times[x]), text) for (x, n), text in values if x in times]
        for name, text in cells or [(("", -1), "")]:
            is_other = number != at and (is_row or len(cells) > 1 or not number)
            if record and (is_other or name in record or len(record) == len(names)):
                yield at, "\t".join(record.get(x, "") for x in names)
                record.clear()
            at, is_row = (at, is_row) if record else (number, len(cells) > 1)
            record |= {name: text} if cells else {}
        if not cells and (not values or vocabulary.is_remark(line) or Row(0, [line]).is_mark):
            yield number, line


def _plain(lines: _Lines) -> list[str]:
    """Return lines that are neither empty nor remarks."""
    return [line for _, line in lines if line.strip() and not vocabulary.is_remark(line)]


def find_separators(lines: Sequence[str], named: int) -> list[str]:
    """Find what stands between the cells: what leaves most values in the lines with a number.

    Parameters
    ----------
    named
        How many values stand between words; where most do, nothing else is between them.
    """
    rows = [line[:1000].strip() for line in lines if re.search("[0-9]", line)][-_JUDGED:]
    marks = [mark for mark in "\t;|" if 2 * sum(mark in row for row in rows) > len(rows)]
    headings = {x.count(",") for x in lines if not re.search("[0-9]", x)}
    has_heading = any(row.count(",") in headings - {0} for row in rows[-1:])
    counts = {"": (named, 0)} if named and not has_heading else {}
    for mark in marks or ", ":
        cells = [kinds_of(text) for row in rows for text in split_cells(row, mark) if text]
        counts[mark] = 2 * sum(map(bool, cells)) - len(cells), len(cells)
    # Where a line is a number with a comma, falls decide whether it is two.
    commas = [*filter(form("decimal comma").fullmatch, rows)]
    is_open = 2 * len(commas) > len(rows) and not has_heading
    return [*[";"] * is_open, max(counts, key=counts.__getitem__)]


def _begins_as(texts: Sequence[str], usual: _Shape) -> bool:
    """Whether the first cells are as those of most rows."""
    return usual != () and _shape(texts[: len(usual)]) == usual


def _shape(texts: Sequence[str]) -> _Shape:
    """Return which cells are filled, and numbers; of most rows of data it is the same."""
    return tuple((text != "", is_measured(text)) for text in texts)
