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

from rig.timers.preamble import Row, RowBlock
from rig.timers.vocabulary import (
    LONGEST,
    MEASURED,
    form,
    is_number,
    is_remark,
    kinds_of,
    normal,
    words,
)

_SAMPLE = 500
"""Lines that show how a file is written; without a row among them it is no table."""
_FEWEST_BESIDE = 20
"""Rows beside nothing that tell samples with settings at their left from rows with empty cells."""


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
        plain = [line for _, line in sample if line.strip() and not is_remark(line)]
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
            return [
                t.replace(",", ".") if form("decimal comma").fullmatch(t[:LONGEST]) else t
                for t in cells
            ]
        return cells

    def _rows(self) -> Iterator[tuple[RowBlock, Row]]:
        """Yield each row of data with its block."""
        block = RowBlock([Row(0, self._names)] if self._names else [], remarks=self.remarks)
        remark = Row(0, [])
        for number, line in self._lines:
            if not line or line.isspace():
                continue
            if block.width and not self._beside and form("plain row").fullmatch(line):
                yield block, Row(number, self.split(line), line, self.separator)
                continue
            mark = form("remark").match(line[:LONGEST])
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
        is_heading = is_again or 0 < len(row.texts) <= 2 * row.known
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
    if not form("list").match(line):
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
    is_named = len(set(usual) - {""}) > 1 and 2 * count > sum(map(bool, rows))
    return list(usual) if is_named else []


def find_separator(lines: Sequence[str]) -> str:
    """Find what stands between the cells: what leaves most values in the lines with a number."""
    rows = [line[:1000].strip() for line in lines if re.search("[0-9]", line[:1000])]
    for separator in "\t;|":
        if sum(separator in row for row in rows) * 2 > len(rows):
            return separator
    is_named = any(re.search("[A-Za-z][A-Za-z0-9]", line) and "," in line for line in lines[:200])
    numbers = [row.replace(",", ".") for row in rows if form("decimal comma").fullmatch(row)]
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


def _is_mark(row: Row) -> bool:
    """Whether a row says that another run, or gate, begins: ``--- Run 2 ---``."""
    text = normal(" ".join(row.texts)).strip("-=*#:<>[] ")
    name = form("mark").match(text)
    is_named = name is not None and name[1].strip() in words()["run"] | words()["gate"]
    is_whole = name is not None and name[3] is not None and bool(name[2] or not name[3])
    return "vernier format" in text or (is_named and is_whole)
