"""A text file as blocks of rows: cells below headings, with remarks and settings.

How the lines of a file are written (cells parted by a separator, or values between words) is found
out from its first lines; then lines are read one after the other, and none is kept.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

from rig.timers import vocabulary
from rig.timers.vocabulary import CLOCK, LONGEST, MEASURED, POWERS, is_number, kinds_of, words

_SAMPLE = 500
"""Lines that show how a file is written; without a row among them it is no table."""
_PLAIN = re.compile(r"[-+0-9.,;eE\t ]*[0-9][-+0-9.,;eE\t ]*")
_DECIMAL = re.compile(r"[-+]?[0-9]*,[0-9]+(?:[eE][-+]?[0-9]{1,2})?")
_LISTED = re.compile(r"\s*(?:\w{1,40}\s?=\s?)?[\[({]+\s*(?=[-+\"'.0-9]|$)|\s*[\])}]+[,;]?\s*$")
"""What programs print around a list of values, or of lists."""
_BETWEEN_LISTS = re.compile(r"[\])}]\s?,\s?(?=[\[({])")
_NAME = re.compile(r"([^\W\d][\w ]*?)[\"']?\s?[=:]?\s?[\"']?$")
"""What stands before a value: ``gate=``, ``"gate": `` or, in a sentence, ``at``."""
REMARK = re.compile(r'\s*"?(?:#|%|//)+\s*|;+\s+(?=[^;]+$)|FRAME-(?:BEGIN|END)')
"""A line that is marked as a remark, or parts what sigrok captured."""
_QUANTITY = re.compile(
    r"([+-]?[0-9]{1,30}(?:[.,][0-9]{0,30})?(?:e[+-]?[0-9]{1,3})?)\s?(?:([kmg]?)hz|([a-zµμ]{0,3}))",
    re.IGNORECASE,
)
_ASSIGNED = re.compile(r"\s?[=:]\s?")
_COLUMN_ROLES = {"time", "state", "edge", "volts", "gate", "run", "duration", "index", "derived"}
_FEWEST_BESIDE = 20
"""Rows beside nothing that tell samples with settings at their left from rows with empty cells."""


class Row(NamedTuple):
    """A line: its number, from 1, what its cells say, and how it was written."""

    line: int
    texts: list[str]
    raw: str = ""
    separator: str = ","

    def cell(self, at: int) -> str:
        """Return what a column, from 0, has; nothing where the row ends before it."""
        text = self.texts[at] if at < len(self.texts) else ""
        # Most are numbers.
        is_missing = not text[:1].isdigit() and text[:5].casefold() in words()["missing"]
        return "" if is_missing else text

    def place(self, at: int) -> tuple[int, int]:
        """Return the line, and the column, from 1, at which a cell begins; 1 without the cell."""
        if at >= len(self.texts):
            return self.line, 1
        if not self.separator:
            return self.line, max(0, self.raw.find(self.texts[at])) + 1
        before = sum(len(cell) + 1 for cell in self.raw.split(self.separator)[:at])
        rest = self.raw[before:]
        return self.line, before + len(rest) - len(rest.lstrip(' "')) + 1


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
        plain = [line for _, line in sample if line.strip() and not REMARK.match(line[:LONGEST])]
        self._names = _find_names(plain)
        self.separator = "" if self._names else find_separator(plain)
        self._usual: tuple[tuple[bool, bool], ...] = ()
        shapes = Counter(_shape(self.split(line)) for line in plain)
        shapes = Counter({shape: n for shape, n in shapes.items() if any(map(all, shape))})
        usual, count = next(iter(shapes.most_common(1)), ((), 0))
        self._usual = usual if 2 * count > max(2, shapes.total()) else ()
        filled = [n for n, (is_filled, _) in enumerate(usual) if is_filled]
        is_beside = count > max(_FEWEST_BESIDE, 0.9 * shapes.total()) and filled[0] > 1
        self._beside = filled if is_beside else []

    def blocks(self) -> Iterator[tuple[RowBlock, Iterator[Row]]]:
        """Yield blocks of rows; the rows of each are to be taken before the next."""
        for block, pairs in itertools.groupby(self._rows(), key=lambda pair: pair[0]):
            yield block, (row for _, row in pairs)

    def split(self, line: str) -> list[str]:
        """Split a line into cells; numbers get a decimal point."""
        if self._names:
            values = dict(_named_values(line))
            return [values.get(name, "") for name in self._names] if any(values) else [line]
        cells = line.split() if self.separator == " " else []
        if not cells or len(cells) != len(self._usual):
            cells = split_cells(line, self.separator)
        if "," in line and (self.separator != "," or '"' in line):
            return [t.replace(",", ".") if _DECIMAL.fullmatch(t[:LONGEST]) else t for t in cells]
        return cells

    def _rows(self) -> Iterator[tuple[RowBlock, Row]]:
        """Yield each row of data with its block."""
        block = RowBlock([Row(0, self._names)] if self._names else [], remarks=self.remarks)
        remark = Row(0, [])
        for number, line in self._lines:
            if not line or line.isspace():
                continue
            if block.width and not self._beside and _PLAIN.fullmatch(line):
                yield block, Row(number, self.split(line), line, self.separator)
                continue
            mark = REMARK.match(line[:LONGEST])
            text = line[mark.end() :].rstrip('" ') if mark else line
            row = Row(number, self.split(text), line, self.separator)
            if mark:
                remark = row
                self.remarks += [row] * (number <= _SAMPLE)
            row = self._without_settings(row, block) if self._beside else row
            if _is_mark(row) if mark else block.width > 0 and self._begins_block(row, block):
                block = RowBlock([row], block.headings, remarks=self.remarks)
            elif not mark and self._is_row(row, block):
                if not block.headings and len(list(filter(None, remark.texts))) == len(row.texts):
                    block.headings.append(remark)  # with a name for each cell
                block.width = block.width or len(row.texts)
                yield block, row
            elif not mark and any(row.texts):
                if block.width:
                    self.strays.append(number)
                elif len(block.headings) > _SAMPLE:
                    return
                else:
                    block.headings.append(row)

    def _without_settings(self, row: Row, block: RowBlock) -> Row:
        """Return a row; settings that stand beside its samples go to the headings."""
        samples = [text if n in self._beside else "" for n, text in enumerate(row.texts)]
        settings = ["" if n in self._beside else text for n, text in enumerate(row.texts)]
        if not (any(settings) and _is_data(samples)):
            return row
        block.headings.append(row._replace(texts=settings))
        return row._replace(texts=samples)

    def _begins_block(self, row: Row, block: RowBlock) -> bool:
        """Whether a row below others is a mark, or a heading, of further ones."""
        is_again = row.texts in [above.texts for above in block.headings]
        is_heading = is_again or 0 < len(row.texts) <= 2 * count_known(row)
        has_number = any(map(is_number, row.texts))
        return (is_heading and not has_number) or (not row.raw[:1].isdigit() and _is_mark(row))

    def _is_row(self, row: Row, block: RowBlock) -> bool:
        texts = row.texts
        is_usual = any(texts) and (_shape(texts) == self._usual or _is_data(texts))
        # One of data with a fault: some of it is a number, as in those above.
        return is_usual or (1 < len(texts) == block.width and any(map(is_number, texts)))


def split_cells(line: str, separator: str) -> list[str]:
    """Split a line into cells, without the blanks and the quotes around them."""
    if separator == " ":
        # A heading has names of several words: two blanks or more part them.
        cells = line.split()
        return cells if all(map(kinds_of, cells)) else re.split(r" {2,}|\t", line.strip())
    if '"' in line:
        (cells,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
        return [text.strip().strip('"').strip() for text in cells]
    return [text.strip() for text in line.split(separator)]


def _unwrap(number: int, line: str) -> list[tuple[int, str]]:
    """Return a line without the brackets around it; lists in a line are lines of their own."""
    if not _LISTED.match(line):
        return [(number, line)]
    pieces = _BETWEEN_LISTS.split(line)
    return [(number, _LISTED.sub("", piece, 1).rstrip("])}, ;")) for piece in pieces]


@cache
def _value_pattern() -> re.Pattern[str]:
    """Return what is a value within words: a time of day, a number or a state, but no key."""
    states = set().union(*(words()[role] for role in ("blocked", "clear", "high", "low")))
    longest = sorted((w for w in states if len(w) > 2), key=len, reverse=True)
    return re.compile(
        rf"(?<![\w.]){CLOCK.pattern}|(?<![\w.])[-+]?[0-9]+(?:[.,][0-9]+)?(?:e[-+]?[0-9]{{1,2}})?"
        r"(?:\s?(?:s|ms|us|µs|μs|ns|micros|millis|seconds))?(?![\w.])"
        r"|(?<=[a-z_])[0-9]{1,4}(?![\w.]|[\"']?\s?[:=])"
        rf"|(?<!\w)(?:{'|'.join(map(re.escape, longest))}|true|false)(?!\w|[\"']?\s?[:=])",
        re.IGNORECASE,
    )


def _named_values(line: str) -> list[tuple[str, str]]:
    """Return the values between the words of a line, each with the words right before it."""
    values, end = [], 0
    for match in _value_pattern().finditer(line[:LONGEST]):
        name = _NAME.search(line[end : match.start()])
        values.append((name[1].strip() if name else "", match[0].replace(",", ".")))
        end = match.end()
    return values


def _find_names(lines: Sequence[str]) -> list[str]:
    """Return what most lines that have values name before these; nothing if they do not."""
    rows = [tuple(name for name, _ in _named_values(line)) for line in lines[:100]]
    usual, count = next(iter(Counter(filter(None, rows)).most_common(1)), ((), 0))
    is_named = len(set(usual) - {""}) > 1 and 2 * count > sum(map(bool, rows))
    return list(usual) if is_named else []


def find_separator(lines: Sequence[str]) -> str:
    """Find what stands between the cells: what leaves most values in the lines with a number."""
    rows = [line[:1000].strip() for line in lines if re.search("[0-9]", line[:1000])]
    for separator in "\t;|":
        if sum(separator in row for row in rows) * 2 > len(rows):
            return separator
    is_named = any(re.search("[A-Za-z][A-Za-z0-9]", line) and "," in line for line in lines[:200])
    numbers = [row.replace(",", ".") for row in rows if _DECIMAL.fullmatch(row)]
    if not is_named and len(numbers) * 2 > len(rows):
        # 0,25 below 1,5 is no decimal comma: times go on. Levels of inputs are 0 and 1.
        is_rising = sorted(numbers, key=float) == numbers and set("".join(rows)) - set("01,")
        return ";" if is_rising else ","
    # Blanks part values; a comma behind one parts them, too.
    parted = [row.split() for row in rows if ", " not in row and " " in row]
    return " " if sum(all(map(kinds_of, row)) for row in parted) * 2 > len(rows) else ","


def _is_data(texts: Sequence[str]) -> bool:
    """Whether cells hold values only, and at least one number or date."""
    kinds = [kinds_of(text) for text in texts if text]
    return all(kinds) and any(MEASURED & kind for kind in kinds)


def _shape(texts: Sequence[str]) -> tuple[tuple[bool, bool], ...]:
    """Return which cells are filled, and numbers; of most rows of data it is the same."""
    return tuple((text != "", bool(MEASURED & kinds_of(text))) for text in texts)


def count_known(row: Row) -> int:
    """Count the cells of a row that say what a column is."""
    texts = [text for text in row.texts if text and not is_number(text)]
    return sum(bool(_COLUMN_ROLES & vocabulary.roles_in(t) or vocabulary.unit_of(t)) for t in texts)


def _is_mark(row: Row) -> bool:
    """Whether a row says that another run, or gate, begins: ``--- Run 2 ---``."""
    text = vocabulary.normal(" ".join(row.texts)).strip("-=*#:<>[] ")
    name = re.match(
        r"([^\W\d]+(?: set)?)\s*(?:[#:]|nr|no)?\s*([0-9]{0,4})[ :=*#-]*(\D{0,12}$)?", text
    )
    is_named = name is not None and name[1].strip() in words()["run"] | words()["gate"]
    is_whole = name is not None and name[3] is not None and bool(name[2] or not name[3])
    return "vernier format" in text or (is_named and is_whole)


def find_time_base(block: RowBlock) -> tuple[float, float] | None:
    """Return the first sample's time and the step, s, that settings state; `None` without.

    A setting's value stands behind its name, after ``:`` or ``=`` or in the next cell, or below it.
    """
    rows, stated = [*block.remarks, *block.headings], dict[str, float]()
    for above, below in itertools.pairwise([*rows, Row(0, [])]):
        for n, text in enumerate(above.texts):
            name, _, inside = _ASSIGNED.sub("\0", text[:60]).partition("\0")
            roles = [r for r in ("rate", "start", "step") if r in vocabulary.roles_in(name)]
            places = (inside, above.cell(n + 1), below.cell(n))
            for role, place in itertools.product(roles[:1], places):
                if match := _QUANTITY.fullmatch(place.strip()):
                    factor = {"k": 3, "m": 6, "g": 9}.get((match[2] or "").lower(), 0)
                    power = factor - POWERS.get(vocabulary.unit_of((match[3] or "").lower()), 0)
                    stated.setdefault(role, float(match[1].replace(",", ".")) * 10.0**power)
    step = stated.get("step") or (1.0 / stated["rate"] if stated.get("rate") else 0.0)
    return (stated.get("start", 0.0), step) if step else None
