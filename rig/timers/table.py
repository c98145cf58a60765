"""Tables as timers write them: rows of cells below headings, in blocks, with remarks and settings.

How the lines of a file are written (cells parted by a separator, names with values, sentences) is
found out from its first lines; then lines are read one after the other, and none is kept.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.timers import vocabulary
from rig.timers.edge_rows import HEADER
from rig.timers.vocabulary import LONGEST, POWERS, is_measured, is_number, is_value, words

if TYPE_CHECKING:
    from rig.arrays import Array
    from rig.timers.problems import ProblemList

_SAMPLE = 500
"""Lines that show how a file is written; without a row among them it is no table."""
_CHUNK = 4096
"""Lines that are read at once, and row by row where that cannot be."""
_ATTEMPTS = 20
"""How often lines are read at once in vain before all are read row by row."""
_PLAIN = re.compile(r"[-+0-9.,;eE\t ]*[0-9][-+0-9.,;eE\t ]*")
_DECIMAL = re.compile(r"[-+]?[0-9]*,[0-9]+(?:[eE][-+]?[0-9]{1,2})?")
_AROUND = re.compile(
    r"^[0-9]{2}:[0-9]{2}:[0-9]{2}[.,][0-9]{3} -> "
    r"|^\s*(?:\w{1,40}\s?=\s?)?[\[(]{1,3}([-+0-9.][^\[\]():]*)[\])]{1,3}[,;]?\s*$"
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

    def column(self, at: int) -> int:
        """Return the column, from 1, at which a cell begins; 1 where the row ends before it."""
        cells = self.raw.split(self.separator)
        before = sum(len(cell) + 1 for cell in cells[:at]) if at < len(self.texts) else 0
        return before + len(self.raw[before:]) - len(self.raw[before:].lstrip(' "')) + 1


@dataclass(eq=False, slots=True)
class RowBlock:
    """Rows that stand together.

    Attributes
    ----------
    headings, above
        What stands above them, and above those of the block before.
    width
        How many cells the first one has.
    base
        Of samples without times: when the first was taken, and the time between them, s.
    """

    headings: list[Row] = field(default_factory=list)
    above: list[Row] = field(default_factory=list)
    width: int = 0
    base: tuple[float, float] = (0.0, 1.0)


class Table:
    """A text file of rows.

    Parameters
    ----------
    lines
        All of them, one after the other, with their numbers.
    problems
        Where faults are noted.

    Attributes
    ----------
    separator
        Of the cells; a blank stands for any number of blanks.
    is_own
        Whether it has the header of the project's own format, or begins as that does.
    remarks
        Lines that are marked as such, without the mark, as far as read.
    strays
        Lines between rows that are neither rows nor headings, as far as read.
    """

    def __init__(self, lines: Iterable[tuple[int, str]], problems: ProblemList) -> None:
        self.problems, self.remarks, self.strays = problems, list[Row](), list[int]()
        # Most lines begin otherwise: to search them costs less than to change them.
        numbered = (
            (number, _AROUND.sub(r"\1", line) if _AROUND.match(line) else line)
            for number, line in lines
        )
        sample = list(itertools.islice(numbered, _SAMPLE))
        self._lines: Iterator[tuple[int, str]] = itertools.chain(sample, numbered)
        head, self._taken, self._attempts = [line for _, line in sample], sample, _ATTEMPTS
        plain = [line for line in head if line.strip() and not _REMARK.match(line[:LONGEST])]
        first = re.sub(r"\s", "", "".join(plain[:1])[:LONGEST].lower()).split(",")
        self.is_own = first[:2] == list(HEADER[:2])
        self._names = [] if self.is_own else _find_names(head)
        self.separator = "," if self.is_own else "\t" if self._names else find_separator(plain)
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

    def take_numbers(self, places: Sequence[int]) -> tuple[list[int], Array] | None:
        """Take further lines at once, if they are rows of plain numbers.

        Returns
        -------
        tuple or None
            Their numbers, and what the columns have, of shape ``(lines, len(places))``; `None`, and
            nothing is taken, where a line is anything else.
        """
        lines = list(itertools.islice(self._lines, _CHUNK * (self._attempts > 0)))
        if not lines:
            return None
        texts = [line if self.separator == "," else line.replace(",", ".") for _, line in lines]
        mark = None if self.separator == " " else self.separator
        try:
            numbers = np.loadtxt(texts, delimiter=mark, usecols=places, comments=None, ndmin=2)
        except ValueError:
            numbers = np.empty((0, 0))
        self._taken = lines
        if len(numbers) == len(lines) and np.isfinite(numbers).all():
            return [number for number, _ in lines], numbers
        self.put_back()
        return None

    def put_back(self) -> None:
        """Give back the lines taken last, to be read row by row."""
        self._attempts -= 1
        self._lines = itertools.chain(self._taken, self._lines)

    def split(self, line: str) -> list[str]:
        """Split a line into cells; numbers get a decimal point."""
        if self._names:
            return _split_named(line[:LONGEST], self._names)
        separator = self.separator
        if separator == " ":
            # A heading has names of several words: two blanks or more part them.
            cells = line.split()
            cells = cells if all(map(is_value, cells)) else re.split(r" {2,}|\t", line.strip())
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
        remark = Row(0, [])
        while pair := next(self._lines, None):
            number, line = pair
            if not line or line.isspace():
                continue
            if block.width and not self._beside and _PLAIN.fullmatch(line):
                yield block, Row(number, self.split(line), line, self.separator)
                continue
            mark = _REMARK.match(line[:LONGEST])
            text = line[mark.end() :].rstrip('" ') if mark else line
            row = Row(number, self.split(text), line, self.separator)
            if mark:
                remark = row
                self.remarks += [row] * (number <= _SAMPLE)
            row = self._without_settings(row, block) if self._beside else row
            begins = _is_mark(row) if mark else block.width > 0 and self._begins_block(row, block)
            if begins and not self.is_own:
                block = RowBlock([row], block.headings)
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
        return _is_mark(row) or (is_heading and not any(map(is_number, row.texts)))

    def _is_row(self, row: Row, block: RowBlock) -> bool:
        if self.is_own:
            return len(block.headings) > 0
        texts, last = row.texts, (block.headings or [Row(0, [])])[-1]
        if any(texts) and (_shape(texts) == self._usual or _is_data(texts)):
            return True
        # One of data with a fault: some of it is a number, as in those above.
        is_timed = any("time" in vocabulary.roles_in(text) for text in last.texts)
        is_named = is_timed and len(last.texts) == len(texts) and not count_known(row)
        is_faulty = len(texts) == block.width if block.width else is_named
        return is_faulty and len(texts) > 1 and any(map(is_number, texts))


def _is_data(texts: Sequence[str]) -> bool:
    """Whether cells hold values only, and at least one number or date."""
    return all(is_value(text) for text in texts if text) and any(map(is_measured, texts))


def _shape(texts: Sequence[str]) -> tuple[tuple[bool, bool], ...]:
    """Return which cells are filled, and numbers; of most rows of data it is the same."""
    return tuple((text != "", is_measured(text)) for text in texts)


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
    is_named = any(re.search("[A-Za-z][A-Za-z0-9]", line) and "," in line for line in lines[:200])
    numbers = [row.replace(",", ".") for row in rows if _DECIMAL.fullmatch(row)]
    if not is_named and len(numbers) * 2 > len(rows):
        # 0,25 below 1,5 is no decimal comma: times go on. Levels of inputs are 0 and 1.
        is_rising = sorted(numbers, key=float) == numbers and set("".join(rows)) - set("01,")
        return ";" if is_rising else ","
    # Blanks part values; a comma behind one parts them, too.
    parted = [row.split() for row in rows if ", " not in row and " " in row]
    return " " if sum(all(map(is_value, row)) for row in parted) * 2 > len(rows) else ","


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


def find_time_base(rows: Sequence[Row]) -> tuple[float, float] | None:
    """Return the first sample's time and the step, s, that settings state; `None` without.

    A setting's value stands behind its name, after ``:`` or ``=`` or in the next cell, or below it.
    """
    stated: dict[str, float] = {}
    for above, below in itertools.zip_longest(rows, rows[1:], fillvalue=Row(0, [])):
        for n, text in enumerate(above.texts):
            name, _, inside = _ASSIGNED.sub("\0", text[:60]).partition("\0")
            role = next(
                (r for r in ("rate", "start", "step") if r in vocabulary.roles_in(name)), ""
            )
            for place in (inside, above.cell(n + 1), below.cell(n)) if role else ():
                match = _QUANTITY.fullmatch(place.strip())
                if match and role not in stated:
                    factor = {"k": 3, "m": 6, "g": 9}.get((match[2] or "").lower(), 0)
                    power = factor - POWERS.get(vocabulary.unit_of((match[3] or "").lower()), 0)
                    stated[role] = float(match[1].replace(",", ".")) * 10.0**power
    step = stated.get("step") or (1.0 / stated["rate"] if stated.get("rate") else 0.0)
    return (stated.get("start", 0.0), step) if step else None
