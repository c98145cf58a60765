"""A text file as blocks of rows: cells below a preamble of headings, units, remarks and settings.

How the lines of a file are written (cells parted by a separator, or values between words) is found
out from its first lines; then lines are read one after the other, and none is kept. A setting is a
name with its value behind ``:`` or ``=``, in the next cell or below it.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from rig.timers import vocabulary
from rig.timers.vocabulary import LONGEST, form, is_measured, is_number, kinds_of, roles_in

TimeBase = tuple[float, float]
"""When the first sample was taken, and the time between two, s."""
_COLUMN_ROLES = {"time", "elapsed", "state", "edge", "volts", "gate", "run", "duration"}
_COLUMN_ROLES |= {"index", "derived"}
_UNFILLED = {"setting", "index", "derived"}
"""Roles of columns that may have a name and no values: a rate, comments, or distances."""
_PREFIXES = {"k": 3, "m": 6, "g": 9}
_SAMPLE = 500
"""Lines that show how a file is written; without a row among them it is no table."""


class Row(NamedTuple):
    """A line: its number, from 1, what its cells say, and how it was written."""

    line: int
    texts: list[str]
    raw: str = ""

    def cell(self, at: int) -> str:
        """Return what a column, from 0, has; nothing where the row ends before it."""
        text = self.texts[at] if at < len(self.texts) else ""
        if not text or text[0].isdigit():  # as most
            return text
        return "" if text[:5].casefold() in vocabulary.words()["missing"] else text

    @property
    def known(self) -> int:
        """How many cells say what a column is."""
        roles = [{*_COLUMN_ROLES & roles_in(x), vocabulary.unit_of(x)} - {""} for x in self.texts]
        return sum(map(bool, roles)) if set().union(*roles) - {"derived", "index"} else 0

    @property
    def is_mark(self) -> bool:
        """Whether it says that another run, or gate, begins: ``--- Run 2 ---``."""
        text = vocabulary.normal(" ".join(self.texts)).strip("-=*#:<>[] ")
        return form("mark").fullmatch(text) is not None

    @property
    def is_gate(self) -> bool:
        """Whether it is such a mark of a gate."""
        return self.is_mark and vocabulary.find_label(self.raw, "gate") != ""

    @property
    def has_units(self) -> bool:
        """Whether it has units only, perhaps behind their name: ``Y_Unit_Label``."""
        texts = [vocabulary.normal(text.strip("()[]- ")) for text in self.texts]
        texts = list(filter(None, texts))
        is_unit = [form("unit").fullmatch(text) is not None for text in texts]
        is_named = form("name of units").match("".join(texts[:1])) is not None
        return bool(texts) and all(is_unit[1:]) and (is_unit[0] or is_named)

    def place(self, at: int) -> tuple[int, int]:
        """Return the line, and the column, from 1, at which a cell begins; 1 without the cell."""
        if at >= len(self.texts):
            return self.line, 1
        begin, end, raw = 0, 0, self.raw.replace(",", ".")
        for text in self.texts[: at + 1]:
            begin = max(end, raw.find(text.replace(",", "."), end))
            end = begin + len(text) + 1
        return self.line, begin + 1


@dataclass(eq=False, slots=True)
class RowBlock:
    """Rows that stand together.

    Attributes
    ----------
    headings, above
        What stands above them, and above those of the block before.
    width
        How many cells the first one has.
    remarks
        Of the whole file, as far as read.
    """

    headings: list[Row] = field(default_factory=list)
    above: list[Row] = field(default_factory=list)
    width: int = 0
    remarks: list[Row] = field(default_factory=list)

    def begin(self, width: int) -> None:
        """Begin its rows: one without a heading as wide as these has that of the block above."""
        self.width = width
        if all(len(row.texts) != width for row in self.headings):
            self.headings += [row for row in self.above if not row.is_mark]

    @property
    def is_gate(self) -> bool:
        """Whether a gate stands above it, so that it is of the run of the block before."""
        return any(row.is_gate for row in self.headings)

    @property
    def key(self) -> object:
        """What is the same for blocks whose columns are: all above but the run's name."""
        rows = (row for row in self.headings if row.is_gate or not row.is_mark)
        return self.width, *(tuple(row.texts) for row in rows)

    def find_heading(self, filled: Collection[int], width: int) -> Row | None:
        """Return the row with most cells that are known; above and below may stand symbols, units.

        A row with a measured number, or with more names than there are columns, is a setting. A
        remark may name the columns where nothing else does.
        """
        is_numbered = form("time and numbers").fullmatch
        remarks = (row for row in self.remarks if not form("assignment").search(row.texts[0]))
        rows = [
            row
            for row in self.headings or [row for row in remarks if len(row.texts) == width]
            if row.known
            and not row.is_mark
            and (len(row.texts) > 1 or len(filled) == 1)
            and all(_UNFILLED & roles_in(text) for text in filter(None, row.texts[width:]))
            and (is_numbered(row.raw) or not any(map(is_measured, row.texts[:width])))
        ]
        return max(rows, key=lambda row: (row.known, len("".join(row.texts))), default=None)

    def find_time_base(self) -> TimeBase | None:
        """Return the first sample's time and the step, s, that settings state; `None` without."""
        stated: dict[str, float] = {}
        for above, below in itertools.pairwise([*self.remarks, *self.headings, Row(0, [])]):
            for n, text in enumerate(above.texts):
                name, *inside = form("assignment").split(text[:60], 1)
                places = map(str.strip, (*inside, above.cell(n + 1), below.cell(n)))
                quantity = next(filter(None, map(form("quantity").fullmatch, places)), None)
                role = next((x for x in ("rate", "start", "step") if x in roles_in(name)), "")
                if role and quantity:
                    number, prefix, unit = quantity.groups("")
                    power = vocabulary.POWERS.get(vocabulary.unit_of(unit.lower()), 0)
                    power = _PREFIXES.get(prefix.lower(), 0) - power
                    stated.setdefault(role, float(number.replace(",", ".")) * 10.0**power)
        step = stated.get("step") or (1.0 / stated["rate"] if stated.get("rate") else 0.0)
        return (stated.get("start", 0.0), step) if step else None

    def find_inputs(self, count: int) -> list[str]:
        """Return names of inputs without a heading: those of a row that lists as many."""
        for row in [*self.remarks, *self.headings]:
            labels = [vocabulary.find_label(text.rpartition(":")[2], "gate") for text in row.texts]
            if len(names := [label for label in labels if label]) == count:
                return names
        return []


class Table:
    """A text file of rows.

    Parameters
    ----------
    lines
        All of them, one after the other, with their numbers.

    Attributes
    ----------
    separator
        Of the cells; a blank stands for any number of blanks, nothing for words between values.
    remarks
        Lines that are marked as such, without the mark, as far as read.
    strays
        Lines between rows that are neither rows nor headings, as far as read.
    """

    def __init__(self, lines: Iterable[tuple[int, str]]) -> None:
        self.remarks, self.strays = list[Row](), list[int]()
        unwrapped = (pair for number, line in lines for pair in _unwrap(number, line))
        sample = list(itertools.islice(unwrapped, _SAMPLE))
        self._lines = itertools.chain(sample, unwrapped)
        plain = [line for _, line in sample if line.strip() and not vocabulary.is_remark(line)]
        self._names = _find_names(plain)
        self.separator = "" if self._names else find_separator(plain)
        self._usual: tuple[tuple[bool, bool], ...] = ()
        shapes = Counter(x for x in (_shape(self.split(y)) for y in plain) if any(map(all, x)))
        self._fewest = 1 + (2 * sum(n for x, n in shapes.items() if len(x) > 1) > shapes.total())
        usual, count = next(iter(shapes.most_common(1)), ((), 0))
        self._usual = usual if 2 * count > max(2, shapes.total()) else ()

    def blocks(self) -> Iterator[tuple[RowBlock, Iterator[Row]]]:
        """Yield blocks of rows; the rows of each are to be taken before the next."""
        for block, pairs in itertools.groupby(self._rows(), key=lambda pair: pair[0]):
            yield block, (row for _, row in pairs)

    def split(self, line: str) -> list[str]:
        """Split a line into cells; numbers get a decimal point."""
        if self._names:
            values = dict(_named_values(line))
            return [values.get(name, "") for name in self._names] if any(values) else [line]
        cells = split_cells(line, self.separator, len(self._usual))
        if "," not in line:  # as most
            return cells
        has_comma = form("decimal comma").fullmatch
        return [t.replace(",", ".") if has_comma(t[:LONGEST]) else t for t in cells]

    def _rows(self) -> Iterator[tuple[RowBlock, Row]]:
        """Yield each row of data with its block."""
        block = RowBlock([Row(0, self._names)] if self._names else [], remarks=self.remarks)
        is_plain = form("plain row").fullmatch
        for number, line in self._lines:
            if not line.strip():
                continue
            if block.width and is_plain(line):
                yield block, Row(number, self.split(line), line)
                continue
            mark = form("remark").match(line[:LONGEST])
            text = line[mark.end() :].rstrip('" ') if mark else line
            row = Row(number, self.split(text), line)
            self.remarks += [row] if mark and number <= _SAMPLE else []
            if row.is_mark if mark else block.width > 0 and self._begins_block(row, block):
                above = [*([] if block.width else block.above), *block.headings]
                block = RowBlock([row], above, remarks=self.remarks)
            elif not mark and self._is_row(row, block):
                if not block.width:
                    block.begin(len(row.texts))
                yield block, row
            elif not mark and any(row.texts):
                if block.width:
                    self.strays.append(number)
                elif len(block.headings) > _SAMPLE:
                    return
                else:
                    block.headings.append(row)

    def _begins_block(self, row: Row, block: RowBlock) -> bool:
        """Whether a row below others is a mark, or a heading, of further ones."""
        if any(map(is_number, row.texts)):  # most are rows
            return not row.raw[:1].isdigit() and row.is_mark
        is_again = row.texts in [above.texts for above in block.headings]
        return is_again or row.is_mark or 0 < len(row.texts) <= 2 * row.known

    def _is_row(self, row: Row, block: RowBlock) -> bool:
        texts, shape, usual = row.texts, _shape(row.texts), self._usual
        if usual and not any(is_filled for is_filled, _ in usual[:2]):
            # Samples of an oscilloscope, beside which settings may stand.
            shape = tuple(a if b[0] else b for a, b in zip(shape, usual, strict=False))
        # Above rows of several cells may stand a date, or a count.
        if shape == usual or (len(texts) >= self._fewest and _is_data(texts)):
            return True
        # One of data with a fault: some of it is a number, as in those above, or below their names.
        if not any(map(is_number, texts)):
            return False
        named = {len(above.texts) for above in block.headings if len(above.texts) == above.known}
        return len(texts) == block.width or len(texts) in named


def split_cells(line: str, separator: str, usual: int = 0) -> list[str]:
    """Split a line into cells, without the blanks and the quotes around them."""
    if separator == " ":
        # A heading has names of several words: two blanks or more part them.
        cells = _words(line)
        is_row = len(cells) == usual or all(map(kinds_of, cells))
        return cells if is_row else re.split(r" {2,}|\t", line.strip())
    if '"' in line:
        (cells,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
        return [text.strip().strip('"').strip() for text in cells]
    return [text.strip() for text in line.split(separator)]


def _words(line: str) -> list[str]:
    """Return the words of a line, without quotes and without what a sentence has behind them."""
    return [word.strip('":') for word in line.split()]


def _unwrap(number: int, line: str) -> list[tuple[int, str]]:
    """Return a line without the brackets around it; lists in a line are lines of their own."""
    line = form("exponent of Fortran").sub("E", line) if "D" in line else line
    if line[:1].isdigit() or not form("list").match(line):
        return [(number, line)]
    pieces = form("between lists").split(line)
    return [(number, form("list").sub("", piece, 1).rstrip("])}, ;")) for piece in pieces]


def _named_values(line: str) -> list[tuple[str, str]]:
    """Return the values between the words of a line, each with the words right before it."""
    values, end = [], 0
    for match in form("value").finditer(line[:LONGEST]):
        name = form("value name").search(line[end : match.start()])
        values.append((name[1].strip() if name else "", match[0].replace(",", ".")))
        end = match.end()
    return values


def _find_names(lines: Sequence[str]) -> list[str]:
    """Return what most lines that have values name before these; nothing if they do not."""
    rows = [tuple(name for name, _ in _named_values(line)) for line in lines[:100]]
    usual, count = next(iter(Counter(filter(None, rows)).most_common(1)), ((), 0))
    marks = [[line.count(mark) for mark in "\t;,"] for line in lines[:100]]
    is_named = len(set(usual) - {""}) > 1 and 2 * count > sum(map(bool, rows))
    # Below a heading with as many cells, words beside values are parts of cells: Gate 1, Run 2.
    heads = [cells for row, cells in zip(rows, marks, strict=True) if not row and any(cells)]
    is_named &= not any(cells in heads for row, cells in zip(rows, marks, strict=True) if row)
    return list(dict.fromkeys(usual)) if is_named else []


def find_separator(lines: Sequence[str]) -> str:
    """Find what stands between the cells: what leaves most values in the lines with a number."""
    rows = [line[:1000].strip() for line in lines if re.search("[0-9]", line[:1000])]
    for separator in "\t;|":
        if sum(separator in row for row in rows) * 2 > len(rows):
            return separator
    is_named = any(re.search("[A-Za-z][A-Za-z0-9]", line) and "," in line for line in lines[:200])
    numbers = [row.replace(",", ".") for row in rows if form("decimal comma").fullmatch(row)]
    if not is_named and len(numbers) * 2 > len(rows):
        # 0,25 below 1,5 is no decimal comma: times go on.
        return ";" if sorted(numbers, key=float) == numbers else ","
    # Blanks part values; a comma behind one parts them, too.
    parted = [_words(row) for row in rows if ", " not in row and " " in row]
    return " " if sum(all(map(kinds_of, row)) for row in parted) * 2 > len(rows) else ","


def _is_data(texts: Sequence[str]) -> bool:
    """Whether cells hold values only, and at least one number or date."""
    kinds = [kinds_of(text) for text in texts if text]
    return all(kinds) and any(is_measured(text) for text in texts)


def _shape(texts: Sequence[str]) -> tuple[tuple[bool, bool], ...]:
    """Return which cells are filled, and numbers; of most rows of data it is the same."""
    return tuple((text != "", is_measured(text)) for text in texts)
