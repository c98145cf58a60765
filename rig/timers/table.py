"""Tables as timers write them: rows of cells below headings, in blocks, with remarks and settings.

How the lines of a file are written (cells parted by a separator, names with values, sentences) is
found out from its first lines; then lines are read one after the other, and none is kept.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rig.timers.vocabulary import (
    LONGEST,
    POWERS,
    has_role,
    is_clock,
    is_number,
    is_value,
    normal,
    unit_of,
    words,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

HEADER = ("run", "channel", "time_s", "state")
"""Of the project's own format, in which every line is a row."""
_SAMPLE = 500
"""Lines that show how a file is written; without a row among them it is no table."""
_LISTED = 100
"""Lines that are named, at most."""
_PLAIN = re.compile(r"[-+0-9.,;eE\t ]*[0-9][-+0-9.,;eE\t ]*")
_DECIMAL = re.compile(r"[-+]?[0-9]*,[0-9]+(?:[eE][-+]?[0-9]{1,2})?")
_AROUND = re.compile(
    r"^[0-9]{2}:[0-9]{2}:[0-9]{2}[.,][0-9]{3} -> "
    r"|^\s*[\[(]{1,3}([-+0-9.][^\[\]():]*)[\])]{1,3},?\s*$"
)
"""What Arduino's serial monitor writes before a line, and Python around a list of numbers."""
_KEYED = re.compile(r"([^\W\d][\w ]{0,40})[\"']?\s?[=:]\s?[\"']?([^\s,;=:\"'{}]{1,60})")
"""A name with its value: ``gate=1``, ``gate: 1`` or, of JSON, ``"gate": 1``."""
_SENTENCE = re.compile(
    r"(?:gate|pin|sensor|channel|beam)[\s#_-]*([0-9]{1,4})\b.*?\b(un|not )?(block|clear|dark)\w*"
    r".*?([0-9]+(?:[.,][0-9]+)?)\s*(us|µs|ms|s|micros|millis|microseconds|milliseconds|seconds)\b",
    re.IGNORECASE,
)
"""What a board may say to whoever reads along: ``Gate 1 blocked at 402345 us``."""
_REMARK = re.compile(r'\s*"?(?:#|%|//)+\s*|;+\s+(?=[^;]+$)|FRAME-(?:BEGIN|END)')
"""A line that is marked as a remark, or parts what sigrok captured."""
_QUANTITY = re.compile(
    r"([+-]?[0-9][0-9.,]{0,30}(?:e[+-]?[0-9]{1,3})?)\s?(?:([kmg]?)hz|([a-zµμ]{0,3}))", re.IGNORECASE
)
_HEADING_ROLES = ("time", "state", "edge", "volts", "gate", "run", "duration", "index", "derived")
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
        if text[:1].isdigit():  # most are numbers
            return text
        return "" if len(text) < 6 and text.casefold() in words()["missing"] else text

    def column(self, at: int) -> int:
        """Return the column, from 1, at which a cell begins; 1 where the row ends before it."""
        mark, place = self.separator, 0
        raw, *cells = [t if mark == "," else t.replace(",", ".") for t in (self.raw, *self.texts)]
        for text in cells[:at]:
            end = max(0, raw.find(text, place)) + len(text)
            place = raw.find(mark, end) + 1 or end
        return max(0, raw.find(cells[at], place)) + 1 if at < len(cells) else 1


@dataclass(eq=False, slots=True)
class RowBlock:
    """Rows that stand together: what stands above them, and how many cells the first one has."""

    headings: list[Row] = field(default_factory=list)
    width: int = 0


class Table:
    """A text file of rows.

    Parameters
    ----------
    lines
        All of them, one after the other.

    Attributes
    ----------
    separator
        Of the cells; a blank stands for any number of blanks.
    is_own
        Whether it has the header of the project's own format, or begins as that does.
    remarks
        Lines that are marked as such, without the mark, as far as read.
    strays, stray_count
        Lines between rows that are neither rows nor headings, as far as read: the first numbers,
        and how many.
    """

    def __init__(self, lines: Iterator[str]) -> None:
        self.remarks: list[Row] = []
        self.strays: list[int] = []
        self.stray_count = 0
        head = list(itertools.islice(lines, _SAMPLE))
        if any(_AROUND.search(line[:LONGEST]) for line in head):
            head = [_AROUND.sub(r"\1", line) for line in head]
            lines = (_AROUND.sub(r"\1", line) for line in lines)
        self._lines = itertools.chain(head, lines)
        plain = [line for line in head if line.strip() and not _REMARK.match(line[:LONGEST])]
        first = re.sub(r"\s", "", plain[0][:LONGEST].lower()).split(",") if plain else []
        self.is_own = first[:2] == list(HEADER[:2])
        self._names = [] if self.is_own else _find_names(head)
        self.separator = "," if self.is_own else "\t" if self._names else find_separator(plain)
        shapes = Counter(self._shape(self.split(line)) for line in plain)
        shapes = Counter({shape: n for shape, n in shapes.items() if any(map(all, shape))})
        usual, count = next(iter(shapes.most_common(1)), ((), 0))
        self._usual = usual if 2 * count > max(2, shapes.total()) else ()
        filled = [n for n, (is_filled, _) in enumerate(usual) if is_filled]
        is_beside = count > max(_FEWEST_BESIDE, 0.9 * shapes.total())
        self._beside = filled if is_beside and filled[0] > 1 else []

    def blocks(self) -> Iterator[tuple[RowBlock, Iterator[Row]]]:
        """Yield blocks of rows; the rows of each are to be taken before the next."""
        for block, pairs in itertools.groupby(self._rows(), key=lambda pair: pair[0]):
            yield block, (row for _, row in pairs)

    def split(self, line: str) -> list[str]:
        """Split a line into cells; numbers get a decimal point."""
        if self._names:
            return _split_named(line[:LONGEST], self._names)
        separator = self.separator
        if separator == " ":
            # A heading has names of several words: two blanks or more part them.
            cells = line.split()
            if not all(map(is_value, cells)):
                cells = re.split(r" {2,}|\t", line.strip())
        elif '"' in line:
            (cells,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
            cells = [text.strip().strip('"').strip() for text in cells]
        else:
            cells = [text.strip() for text in line.split(separator)]
        if not self.is_own and "," in line and (separator != "," or '"' in line):
            cells = [t.replace(",", ".") if _DECIMAL.fullmatch(t[:LONGEST]) else t for t in cells]
        return cells

    def _rows(self) -> Iterator[tuple[RowBlock, Row]]:
        """Yield each row of data with its block."""
        block = RowBlock([Row(0, self._names)] if self._names else [])
        remark: Row | None = None
        for number, line in enumerate(self._lines, 1):
            if not line or line.isspace():
                continue
            if block.width and not self._beside and _PLAIN.fullmatch(line):
                yield block, Row(number, self.split(line), line, self.separator)
            elif mark := _REMARK.match(line[:LONGEST]):
                remark = Row(number, self.split(line[mark.end() :].rstrip('" ')), line)
                self.remarks += [remark] * (number <= _SAMPLE)
                if _is_mark(remark) and not self.is_own:
                    block = RowBlock([remark])
            else:
                row = self._without_settings(number, line, block)
                if block.width and self._begins_block(row, block):
                    block = RowBlock([row])
                elif self._is_row(row, block):
                    if not block.width and not block.headings and remark is not None:
                        # A heading that is marked as a remark has a name for each cell.
                        name_count = len(list(filter(None, remark.texts))) == len(row.texts)
                        block.headings += [remark] * name_count
                    block.width = block.width or len(row.texts)
                    yield block, row
                elif not self._put_aside(row, block):
                    return

    def _without_settings(self, number: int, line: str, block: RowBlock) -> Row:
        """Return a row; settings that stand beside its samples go to the headings."""
        row = Row(number, self.split(line), line, self.separator)
        samples = [text if n in self._beside else "" for n, text in enumerate(row.texts)]
        settings = ["" if n in self._beside else text for n, text in enumerate(row.texts)]
        if self._beside and any(settings) and self._is_data(samples):
            block.headings.append(row._replace(texts=settings))
            row = row._replace(texts=samples)
        return row

    def _put_aside(self, row: Row, block: RowBlock) -> bool:
        """Take a line that is no row for a heading, or a stray; false after too many of them."""
        if block.width and any(row.texts):
            self.stray_count += 1
            self.strays += [row.line] * (len(self.strays) < _LISTED)
        elif any(row.texts):
            block.headings.append(row)
        return block.width > 0 or len(block.headings) <= _SAMPLE

    def _begins_block(self, row: Row, block: RowBlock) -> bool:
        """Whether a row below others is a mark, or a heading, of further ones."""
        if self.is_own or any(map(is_number, row.texts)):
            return _is_mark(row) and not self.is_own
        texts = [text.casefold() for text in row.texts]
        again = any(texts == [text.casefold() for text in above.texts] for above in block.headings)
        words_known = count_known(row)
        return again or _is_mark(row) or 0 < len(texts) <= 2 * words_known

    def _is_row(self, row: Row, block: RowBlock) -> bool:
        if self.is_own:
            return len(block.headings) > 0
        texts = row.texts
        if not any(texts):
            return False
        if self._shape(texts) == self._usual or self._is_data(texts):
            return True
        if len(texts) < 2 or not any(map(is_number, texts)):
            return False
        # One of data with a fault: some of it is a number, as in those above.
        if block.width:
            return len(texts) == block.width
        alike = [above for above in block.headings if len(above.texts) == len(texts)]
        return not count_known(row) and any(
            count_known(above) > 1 and any(has_role(text, "time") for text in above.texts)
            for above in alike
        )

    def _is_data(self, texts: Sequence[str]) -> bool:
        """Whether cells hold values only, and at least one number or date."""
        filled = [text for text in texts if text]
        return all(map(is_value, filled)) and any(
            is_number(text) or is_clock(text) for text in filled
        )

    def _shape(self, texts: Sequence[str]) -> tuple[tuple[bool, bool], ...]:
        """Return which cells are filled, and numbers; of most rows of data it is the same."""
        return tuple((text != "", is_number(text) or is_clock(text)) for text in texts)


def _find_names(lines: Sequence[str]) -> list[str]:
    """Return what most lines name before each value, or what most sentences say."""
    sample = [line[:LONGEST] for line in lines if line.strip()]
    named = [[name.strip() for name, _ in _KEYED.findall(line)] for line in sample]
    names = max(named, key=len, default=[])
    if sum(len(set(names) & set(row)) > 1 for row in named) * 2 > len(sample):
        return names
    matches = [match for line in sample if (match := _SENTENCE.search(line))]
    units = {match[5] for match in matches}
    is_said = len(units) == 1 and len(matches) * 2 > len(sample)
    return ["gate", f"time ({units.pop()})", "state"] if is_said else []


def _split_named(line: str, names: Sequence[str]) -> list[str]:
    row = {name.strip(): value for name, value in _KEYED.findall(line)}
    if set(row) & set(names):
        return [row.get(name, "") for name in names]
    match = _SENTENCE.search(line)
    if match is None:  # with numbers, it is a faulty row
        return ["0", line, ""] if len(re.findall("[0-9]+", line)) > 1 else [line]
    blocked = (match[3].lower() != "clear") is not bool(match[2])
    return [match[1], match[4].replace(",", "."), str(int(blocked))]


def find_separator(lines: Sequence[str]) -> str:
    """Find what stands between the cells: what leaves most values in the lines with a number."""
    rows = [line[:1000].strip() for line in lines if re.search("[0-9]", line[:1000])]
    for separator in "\t;|":
        if sum(separator in row for row in rows) * 2 > len(rows):
            return separator
    is_blank = sum(_has_values(row.split()) for row in rows) * 2 > len(rows)
    is_named = any(re.search("[A-Za-z][A-Za-z0-9]", line) and "," in line for line in lines[:200])
    numbers = [row.replace(",", ".") for row in rows if _DECIMAL.fullmatch(row)]
    if not is_named and len(numbers) * 2 > len(rows):
        # 0,25 below 1,5 is no decimal comma: times go on. Levels of inputs are 0 and 1.
        values = [float(number) for number in numbers]
        is_rising = values == sorted(values) and set("".join(rows)) - set("01,")
        return ";" if is_rising else ","
    return " " if is_blank else ","


def _has_values(cells: Sequence[str]) -> bool:
    """Whether blanks part values; a comma behind one parts them, too."""
    return len(cells) > 1 and all(text[-1] != "," and is_value(text) for text in cells)


def count_known(row: Row) -> int:
    """Count the cells of a row that say what a column is."""
    return sum(
        any(has_role(text, role) for role in _HEADING_ROLES) or unit_of(text) != ""
        for text in row.texts
        if text and not is_number(text)
    )


def _is_mark(row: Row) -> bool:
    """Whether a row says that another run, or gate, begins: ``--- Run 2 ---``."""
    text = normal(" ".join(row.texts)).strip("-=*#:<>[] ")
    name = re.match(r"([^\W\d]+(?: set)?)\s*(?:[#:]|nr|no)?\s*([0-9]{0,4})", text)
    rest = "" if name is None else text[name.end() :].strip(" :-=*#")
    return "vernier format" in text or bool(
        name
        and name[1].strip() in words()["run"] | words()["gate"]
        and (not rest or (name[2] and len(rest) <= 12 and not re.search("[0-9]", rest)))
    )


def find_time_base(rows: Sequence[Row]) -> tuple[float, float] | None:
    """Return the first sample's time and the step, s, that settings state; `None` without.

    A setting's value stands behind its name, after ``:`` or ``=`` or in the next cell, or below it.
    """
    stated: dict[str, float] = {}
    for above, below in itertools.zip_longest(rows, rows[1:], fillvalue=Row(0, [])):
        for n, text in enumerate(above.texts):
            name, _, inside = re.sub(r"\s?[=:]\s?", "\0", text[:60]).partition("\0")
            role = next((r for r in ("rate", "start", "step") if has_role(name, r)), "")
            for place in (inside, above.cell(n + 1), below.cell(n)) if role else ():
                match = _QUANTITY.fullmatch(place.strip())
                if match and role not in stated:
                    factor = {"k": 3, "m": 6, "g": 9}.get((match[2] or "").lower(), 0)
                    power = factor - POWERS.get(unit_of((match[3] or "").lower()), 0)
                    stated[role] = float(match[1].replace(",", ".")) * 10.0**power
    step = stated.get("step") or (1.0 / stated["rate"] if stated.get("rate") else 0.0)
    return (stated.get("start", 0.0), step) if step else None
