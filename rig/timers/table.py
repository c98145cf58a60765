"""Tables as timers write them: remarks, headings, separators, cells and blocks of rows."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rig.timers.edges_csv import read_content
from rig.timers.problems import ProblemList

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,2})?")
BLOCKED = {"1", "blocked", "block", "true", "closed", "dark", "on", "interrupted", "broken",
           "dunkel", "unterbrochen"}  # fmt: skip
CLEAR = {"0", "unblocked", "unblock", "clear", "false", "open", "off", "free", "hell", "frei"}
RISING = {"1", "rising", "rise", "r", "up", "high", "h", "↑", "+"}
FALLING = {"0", "falling", "fall", "f", "down", "low", "l", "↓", "-"}
NO_LEVEL = {"x", "z"}
_WORDS = BLOCKED | CLEAR | RISING | FALLING | NO_LEVEL

_NEW_BLOCK = re.compile(
    r"^(?:run|trial|drop|data ?set|series|lauf|versuch|messung|vernier format)\b", re.IGNORECASE
)
_CLOCK = re.compile(r"^[0-9]{2}:[0-9]{2}:[0-9]{2}[.,][0-9]{3} -> ")
"""What Arduino's serial monitor writes before a line."""
_KEYED = re.compile(r"([A-Za-z_]\w*)\"?\s*[=:]\s*\"?([^\s,;=:\"{}]+)")
"""A name with its value: ``gate=1``, ``gate: 1`` or, of JSON, ``"gate": 1``."""
_SENTENCE = re.compile(
    r"(?:gate|pin|sensor|channel|beam)[\s#_-]*([0-9]+)\b.*?\b(un|not )?(block|clear|dark)\w*"
    r".*?([0-9]+(?:[.,][0-9]+)?)\s*(us|µs|ms|s|micros|millis|microseconds|milliseconds|seconds)\b",
    re.IGNORECASE,
)
"""What a board may say to whoever reads along: ``Gate 1 blocked at 402345 us``."""
_REMARK = re.compile(r'^\s*"?(?:#|%|//)|^;\s+[^;]+$')
NAME_AND_NUMBER = re.compile(r"[A-Za-z_]+[ _-]?[0-9]+")


class TableCell(NamedTuple):
    """A value and the column, from 1, at which it stands."""

    column: int
    text: str


class Row(NamedTuple):
    """A line's number, from 1, and its cells."""

    line: int
    cells: list[TableCell]

    @property
    def texts(self) -> list[str]:
        """What its cells say."""
        return [cell.text for cell in self.cells]

    def cell(self, at: int) -> TableCell:
        """Return the cell of a column, from 0; an empty one where the row ends before it."""
        return self.cells[at] if at < len(self.cells) else TableCell(1, "")


@dataclass(slots=True)
class RowBlock:
    """Rows that stand together, and what stands above them."""

    headings: list[Row] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Table:
    """A text file of rows.

    Attributes
    ----------
    separator
        Of the cells; a blank stands for any number of blanks.
    remarks
        Lines that are marked as such, without the mark.
    blocks
        In order; one but for runs that stand one below the other.
    """

    separator: str
    remarks: tuple[str, ...]
    blocks: tuple[RowBlock, ...]


def lines_of(path: str | os.PathLike[str]) -> list[str]:
    """Read a text file: UTF-8, UTF-16, or what else Windows writes.

    Raises
    ------
    InputError
        A file that cannot be read, is far too large, or is not text.
    """
    problems = ProblemList(str(path))
    content = read_content(path, problems)
    if content[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        return content.decode("utf-16", errors="replace").splitlines()
    if b"\0" in content[:4096]:
        problems.refuse(1, 1, "not_text")
    try:
        return content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace").splitlines()


def read_table(lines: Sequence[str]) -> Table:
    """Split a file into remarks, headings and blocks of rows."""
    lines, names = _strip_keys([_CLOCK.sub(_blanks, line) for line in lines])
    marked = [_REMARK.match(line) is not None for line in lines]
    plain = [line for line, remark in zip(lines, marked, strict=True) if not remark]
    separator = _separator(plain)
    remarks, blocks, last = [], [RowBlock()], None
    if names:
        blocks[0].headings.append(Row(1, [TableCell(1, name) for name in names]))
    for number, line in enumerate(lines, 1):
        if marked[number - 1]:
            last = Row(number, _cells(_strip_mark(line), separator))
            remarks.append(_strip_mark(line).strip())
            continue
        row = Row(number, _cells(line, separator))
        if not any(row.texts):
            continue
        block = blocks[-1]
        if block.rows and (
            _NEW_BLOCK.match(_first_text(row))
            or (not has_number(row, separator) and _repeats_heading(row, block))
        ):
            block = RowBlock()
            blocks.append(block)
        if block.rows or is_data(row, separator) or _is_faulty_data(row, block, separator):
            if (
                not block.rows
                and not block.headings
                and last is not None
                and (len([text for text in last.texts if text]) == len(row.cells))
            ):
                block.headings.append(last)  # a heading that is marked as a remark
            block.rows.append(row)
        else:
            block.headings.append(row)
    return Table(separator, tuple(remarks), tuple(block for block in blocks if block.rows))


def _blanks(match: re.Match[str]) -> str:
    return " " * len(match[0])


def _strip_keys(lines: Sequence[str]) -> tuple[Sequence[str], list[str]]:
    """Take the names out of lines such as ``gate=1 t=402345`` where all have the same."""
    parts = [_KEYED.findall(line) for line in lines]
    names = next(([name for name, _ in pairs] for pairs in parts if len(pairs) > 1), None)
    alike = [[name for name, _ in pairs] == names for pairs in parts]
    if names is None or sum(alike) * 2 <= sum(bool(line.strip()) for line in lines):
        return _strip_sentences(lines)
    return [
        "\t".join(value for _, value in pairs) if same else f"# {line}"
        for line, pairs, same in zip(lines, parts, alike, strict=True)
    ], names


def _strip_sentences(lines: Sequence[str]) -> tuple[Sequence[str], list[str]]:
    """Take gate, state and time out of sentences where most lines are such, with one unit."""
    matches = [_SENTENCE.search(line) for line in lines]
    units = {match[5] for match in matches if match}
    if len(units) != 1 or sum(map(bool, matches)) * 2 <= sum(bool(line.strip()) for line in lines):
        return lines, []
    return [
        f"# {line}" if match is None else f"{match[1]}\t{match[4]}\t{_is_blocked(match)}"
        for line, match in zip(lines, matches, strict=True)
    ], ["gate", f"time ({units.pop()})", "state"]


def _is_blocked(match: re.Match[str]) -> int:
    return int((match[3].lower() != "clear") is not bool(match[2]))


def is_data(row: Row, separator: str) -> bool:
    """Whether a row holds numbers and states only, and at least one number."""
    texts = [text for text in row.texts if text]
    return has_number(row, separator) and all(
        is_number(text, separator) or _is_word(text) for text in texts
    )


def has_number(row: Row, separator: str) -> bool:
    """Whether any cell is a number and nothing else."""
    return any(is_number(text, separator) for text in row.texts)


def is_number(text: str, separator: str) -> bool:
    """Whether a text is a number; decimals have a comma only where none separates cells."""
    return NUMBER.fullmatch(text) is not None and not (separator == "," and "," in text)


def with_point(text: str, separator: str) -> str:
    """Write a number with a decimal point; it may have a comma where none separates cells."""
    return text if separator == "," else text.replace(",", ".", 1)


def as_state(text: str) -> str:
    """Write 1.0 and 0,00, and states in capitals, as a state is written."""
    return re.sub("[.,]0*$", "", text) if NUMBER.fullmatch(text) else text.lower()


def _strip_mark(line: str) -> str:
    return re.sub(r'^\s*"?(?:#|%|//|;)+', lambda mark: " " * len(mark[0]), line)


def _first_text(row: Row) -> str:
    return next(text for text in row.texts if text)


def _repeats_heading(row: Row, block: RowBlock) -> bool:
    """Whether a row is a heading of this block once more."""
    words = [text.lower() for text in row.texts]
    return any(words == [text.lower() for text in above.texts] for above in block.headings)


def _is_faulty_data(row: Row, block: RowBlock, separator: str) -> bool:
    """Whether a row below a heading of as many cells has a number in it: one of data, if faulty."""
    return (
        has_number(row, separator)
        and any(
            len(above.cells) == len(row.cells) and not has_number(above, separator)
            for above in block.headings
        )
        and len(row.cells) > 1
    )


def _separator(lines: Sequence[str]) -> str:
    """Find what stands between the cells of most lines with a number."""
    rows = [line.strip() for line in lines if re.search("[0-9]", line)]
    for separator in ("\t", ";"):
        if sum(separator in row for row in rows) * 2 > len(rows):
            return separator
    heading = next(
        (line for line in lines if "," in line and re.search("[A-Za-z][A-Za-z0-9]", line)), None
    )
    if rows and all(re.fullmatch("[01xX](,[01xX])+", row) for row in rows):
        return ","  # levels of inputs
    numbers = [row for row in rows if all(map(NUMBER.fullmatch, row.split()))]
    if numbers and len(numbers) * 2 > len(rows) and heading is None:
        # 1 0,25 are two numbers, and 0,25 in a column of its own is one.
        parts = [row.split() for row in numbers]
        if any(part.endswith(",") for row in parts for part in row):
            return ","
        if all(len(row) > 1 for row in parts):
            return " "
        # 0,25 below 1,5 is no decimal comma: times go on.
        values = [float(row.replace(",", ".")) for row in numbers]
        return ";" if values == sorted(values) or "," not in numbers[0] else ","
    blanks = [row for row in rows if len(row.split()) > 1 and "," not in row]
    values = [all(map(_is_value, row.split())) for row in blanks]
    return " " if len(blanks) * 2 > len(rows) and sum(values) >= len(blanks) - 1 else ","


def _is_value(text: str) -> bool:
    """Whether a word is a number, a state or the name of an input."""
    return NUMBER.fullmatch(text) is not None or _is_word(text)


def _is_word(text: str) -> bool:
    """Whether a text is a state or the name of an input."""
    return text.lower() in _WORDS or NAME_AND_NUMBER.fullmatch(text) is not None


def _cells(line: str, separator: str) -> list[TableCell]:
    """Split a line; quotes hold a value together."""
    if separator == " ":
        # A heading has names of several words: two blanks or more part them.
        pattern = r"\S+" if all(map(_is_value, line.split())) else r"\S+(?: \S+)*"
        return [TableCell(match.start() + 1, match[0]) for match in re.finditer(pattern, line)]
    cells, start, quoted = [], 0, False
    for position, character in enumerate([*line, separator]):
        if position < len(line) and character == '"':
            quoted = not quoted
        elif position == len(line) or (character == separator and not quoted):
            raw = line[start:position]
            text = raw.strip()
            lead = len(raw) - len(raw.lstrip())
            cells.append(TableCell(start + lead + 1, text.strip('"').strip()))
            start = position + 1
    return cells
