"""Tables as timers write them: encodings, separators, cells, and blocks of rows below headings."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.files import read_input
from rig.timers.problems import ProblemList, refusal
from rig.timers.vocabulary import has_role, normal, state_of, unit_of, words

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

MAX_BYTES = 200_000_000
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,2})?")
_SAMPLE = 2000
"""Lines that show how a file is written."""
LONGEST = 200
"""Characters: no cell, and no line of named values, is longer."""
_PLAIN = re.compile(r"[-+0-9.,;eE\t ]*")
CLOCK = re.compile(
    r"(?:([0-9]{1,4})([-./])([0-9]{1,2})[-./]([0-9]{1,4})[T ]+)?"
    r"(?:([0-9]{1,2}):)?([0-9]{1,3}):([0-9]{1,2}(?:[.,][0-9]{1,15})?)(?:Z|[+-][0-9:]{4,6})?"
)
"""A time of day, perhaps with its date."""
MISSING = {"", "nan", "n/a", "na", "null", "none", "--", "-nan", "#n/a", "#nv"}
"""What stands in a cell that has nothing."""
_NAME = re.compile(r"[A-Za-z_]{1,20}[ _-]?[0-9]{1,4}")
_CLOCK = re.compile(r"^[0-9]{2}:[0-9]{2}:[0-9]{2}[.,][0-9]{3} -> ")
"""What Arduino's serial monitor writes before a line."""
_KEYED = re.compile(r"([^\W\d][\w ]{0,40})\"?\s?[=:]\s?\"?([^\s,;=:\"{}]{1,60})")
"""A name with its value: ``gate=1``, ``gate: 1`` or, of JSON, ``"gate": 1``."""
_SENTENCE = re.compile(
    r"(?:gate|pin|sensor|channel|beam)[\s#_-]*([0-9]{1,4})\b.*?\b(un|not )?(block|clear|dark)\w*"
    r".*?([0-9]+(?:[.,][0-9]+)?)\s*(us|µs|ms|s|micros|millis|microseconds|milliseconds|seconds)\b",
    re.IGNORECASE,
)
"""What a board may say to whoever reads along: ``Gate 1 blocked at 402345 us``."""
_REMARK = re.compile(r'\s*"?(?:#|%|//)|;\s+[^;]+$')
_HEADING_ROLES = ("time", "state", "edge", "volts", "gate", "run", "duration", "index", "derived")


class Row(NamedTuple):
    """A line's number, from 1, and what its cells say."""

    line: int
    texts: list[str]

    def cell(self, at: int) -> str:
        """Return what a column, from 0, has; nothing where the row ends before it."""
        text = self.texts[at] if at < len(self.texts) else ""
        return "" if len(text) < 6 and text.casefold() in MISSING else text


@dataclass(slots=True)
class RowBlock:
    """Rows that stand together, by the numbers of their lines, and what stands above them."""

    headings: list[Row] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Table:
    """A text file of rows.

    Attributes
    ----------
    lines
        All of them.
    separator
        Of the cells; a blank stands for any number of blanks.
    remarks
        Lines that are marked as such, without the mark.
    blocks
        In order; one but for runs, or gates, that stand one below the other.
    strays
        Lines between rows that are neither rows nor headings.
    """

    lines: list[str]
    separator: str
    remarks: list[str] = field(default_factory=list)
    blocks: list[RowBlock] = field(default_factory=list)
    strays: list[int] = field(default_factory=list)

    def row(self, line: int) -> Row:
        """Split a line."""
        return Row(line, split_line(self.lines[line - 1], self.separator))

    def column(self, line: int, at: int) -> int:
        """Return the column, from 1, at which a cell of a line begins."""
        text, separator = self.lines[line - 1], self.separator
        if separator == " ":
            starts = [match.start() for match in re.finditer(r"\S+", text)]
            return starts[min(at, len(starts) - 1)] + 1 if starts else 1
        start, quoted = 0, False
        for place, character in enumerate(text):
            if at and character == separator and not quoted:
                start, at = place + 1, at - 1
            quoted ^= character == '"'
        return 1 if at else start + len(text[start:]) - len(text[start:].lstrip()) + 1

    def is_number(self, text: str) -> bool:
        """Whether a text is a number; its comma is a decimal one only where none parts cells."""
        return is_number(text) and not (self.separator == "," and "," in text)

    def with_point(self, text: str) -> str:
        """Write a number with a decimal point."""
        return text if self.separator == "," else text.replace(",", ".", 1)


def read_content(path: str | os.PathLike[str], problems: ProblemList) -> bytes:
    """Return the bytes of a file.

    Raises
    ------
    InputError
        A file that cannot be read, or is far too large.
    """
    try:
        size = Path(path).stat().st_size
        if size > MAX_BYTES:
            problems.refuse(1, 1, "too_large", size_mb=size / 1e6, limit_mb=MAX_BYTES / 1e6)
        return read_input(path)
    except OSError as error:
        raise refusal(str(path), "unreadable", text=error.strerror or str(error)) from error


def read_lines(path: str | os.PathLike[str]) -> list[str]:
    """Read a text file: UTF-8, UTF-16 with its mark and without, or what else Windows writes.

    Raises
    ------
    InputError
        A file that cannot be read, is far too large, or is not text.
    """
    problems = ProblemList(str(path))
    content = read_content(path, problems)
    start = content[:4096]
    halves = [start[n::2].count(0) * 3 > len(start) for n in (0, 1)]
    if content[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        encoding = "utf-16"
    elif sum(halves) == 1:
        encoding = "utf-16-be" if halves[0] else "utf-16-le"
    elif b"\0" in start:
        problems.refuse(1, 1, "not_text")
    else:
        encoding = "utf-8-sig"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        wide = encoding.startswith("utf-16")
        text = content.decode(encoding if wide else "cp1252", errors="replace")
    return text.splitlines()


def read_table(lines: Sequence[str]) -> Table:
    """Split a file into remarks, headings and blocks of rows."""
    lines, names = _strip_names([_CLOCK.sub("", line) for line in lines])
    marked = [_REMARK.match(line[:LONGEST]) is not None for line in lines]
    separator = find_separator(
        [line for line, remark in zip(lines, marked, strict=True) if not remark]
    )
    table = Table(list(lines), separator)
    shapes = Counter(
        shape
        for number, remark in enumerate(marked[:_SAMPLE], 1)
        if not remark and any(map(all, shape := _shape(table.row(number), table)))
    )
    (usual, count), *_ = shapes.most_common(1) or [((), 0)]
    usual = usual if 2 * count > max(2, shapes.total()) else ()
    table.blocks.append(RowBlock([Row(1, names)] if names else []))
    heading: Row | None = None
    for number, line in enumerate(table.lines, 1):
        block = table.blocks[-1]
        if block.rows and _PLAIN.fullmatch(line) and any(map(str.isdigit, line[:LONGEST])):
            block.rows.append(number)
        elif marked[number - 1]:
            text = re.sub(r'^\s*"?(?:#|%|//|;)+\s*', "", line)
            table.remarks.append(text.strip())
            heading = Row(number, split_line(text, separator))
            if _is_mark(heading):
                table.blocks.append(RowBlock([heading]))
        elif line.strip():
            row = table.row(number)
            _place(row, table, heading, is_usual=_shape(row, table) == usual)
    table.blocks[:] = [block for block in table.blocks if block.rows]
    for block in table.blocks:
        _take_rows_beside_settings(block, table)
    return table


def _shape(row: Row, table: Table) -> tuple[tuple[bool, bool], ...]:
    """Return which cells of a row are filled, and numbers; of most rows of data it is the same."""
    return tuple((text != "", table.is_number(text)) for text in row.texts)


def _place(row: Row, table: Table, remark: Row | None, *, is_usual: bool) -> None:
    """Put a line among the rows, or the headings, of a block; the last remark may be a heading."""
    block = table.blocks[-1]
    if not any(row.texts):
        return
    if block.rows and (_is_mark(row) or _is_heading(row, block, table)):
        table.blocks.append(RowBlock([row]))
    elif is_usual or is_data(row.texts, table) or _is_faulty(row, block, table):
        if not block.rows and not block.headings and remark is not None:
            # A heading that is marked as a remark has as many names as there are cells.
            names = [text for text in remark.texts if text]
            block.headings += [remark] * (len(names) == len(row.texts))
        block.rows.append(row.line)
    elif block.rows:
        table.strays.append(row.line)
    else:
        block.headings.append(row)


def _take_rows_beside_settings(block: RowBlock, table: Table) -> None:
    """Take samples that stand to the right of an instrument's settings, line by line."""
    first = table.row(block.rows[0]).texts
    width = next((n for n, text in enumerate(first) if text), 0)
    beside = [
        row.line
        for row in block.headings
        if width > 1
        and len(row.texts) > width
        and is_data(row.texts[width:], table)
        and row.texts[0]
    ]
    for line in beside:
        table.lines[line - 1] = table.separator * width + table.separator.join(
            table.row(line).texts[width:]
        )
    block.rows[:0] = beside


def _strip_names(lines: Sequence[str]) -> tuple[Sequence[str], list[str]]:
    """Take the names out of lines such as ``gate=1 t=402345`` where most have the same."""
    sample = [line[:LONGEST] for line in lines[:_SAMPLE] if line.strip()]
    named = [[name.strip() for name, _ in _KEYED.findall(line)] for line in sample]
    names = max(named, key=len, default=[])
    if sum(len(set(names) & set(row)) > 1 for row in named) * 2 > len(sample):
        return [_take_values(line, names) for line in lines], names
    matches = [match for line in sample if (match := _SENTENCE.search(line))]
    units = {match[5] for match in matches}
    if len(units) == 1 and len(matches) * 2 > len(sample):
        return [_take_sentence(line) for line in lines], ["gate", f"time ({units.pop()})", "state"]
    return lines, []


def _take_values(line: str, names: Sequence[str]) -> str:
    row = {name.strip(): value for name, value in _KEYED.findall(line[:LONGEST])}
    return "\t".join(row.get(name, "") for name in names) if set(row) & set(names) else line


def _take_sentence(line: str) -> str:
    """Take gate, time and state out of a sentence; a line that is none stays, as a faulty row."""
    match = _SENTENCE.search(line[:LONGEST])
    if match is None:
        return f"0\t{line}\t" if len(re.findall("[0-9]+", line[:LONGEST])) > 1 else line
    blocked = (match[3].lower() != "clear") is not bool(match[2])
    return f"{match[1]}\t{match[4]}\t{int(blocked)}"


def is_number(text: str) -> bool:
    """Whether a text is a number, with a decimal point or a comma."""
    return len(text) <= LONGEST and NUMBER.fullmatch(text) is not None


def is_value(text: str) -> bool:
    """Whether a word is a number, a date, a state or the name of an input."""
    if is_number(text) or state_of(text) or text.casefold() in {"x", "z", *MISSING}:
        return True
    if len(text) > LONGEST or has_role(text, "start"):
        return False
    return bool(_NAME.fullmatch(text) or CLOCK.fullmatch(text))


def is_data(texts: Sequence[str], table: Table) -> bool:
    """Whether a row holds values only, and at least one number or date."""
    filled = [text for text in texts if text]
    return any(table.is_number(text) or CLOCK.fullmatch(text) for text in filled) and all(
        is_value(text) and not (table.separator == "," and "," in text) for text in filled
    )


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
    roles = words()["run"] | words()["gate"]
    name = re.match(r"([^\W\d]+(?: set)?)\s*(?:[#:]|nr|no)?\s*([0-9]{0,4})", text)
    rest = "" if name is None else text[name.end() :].strip(" :-=*#")
    return "vernier format" in text or bool(
        name
        and name[1].strip() in roles
        and (not rest or (name[2] and len(rest) <= 12 and not re.search("[0-9]", rest)))
    )


def _is_heading(row: Row, block: RowBlock, table: Table) -> bool:
    """Whether a row below others is a heading of further ones."""
    if any(map(table.is_number, row.texts)):
        return False
    words = [text.casefold() for text in row.texts]
    repeated = any(words == [text.casefold() for text in above.texts] for above in block.headings)
    return repeated or (count_known(row) > 0 and count_known(row) * 2 >= len(row.texts))


def _is_faulty(row: Row, block: RowBlock, table: Table) -> bool:
    """Whether a row is one of data with a fault: some of it is a number, as in those above."""
    if len(row.texts) < 2 or not any(map(table.is_number, row.texts)):
        return False
    if block.rows:
        return len(row.texts) == len(table.row(block.rows[0]).texts)
    like = [above for above in block.headings if len(above.texts) == len(row.texts)]
    return count_known(row) == 0 and any(
        count_known(above) > 1 and any(has_role(text, "time") for text in above.texts)
        for above in like
    )


def find_separator(lines: Sequence[str]) -> str:
    """Find what stands between the cells of most lines with a number."""
    rows = [line.strip() for line in lines[:_SAMPLE] if re.search("[0-9]", line)]
    for separator in ("\t", ";"):
        if sum(separator in row for row in rows) * 2 > len(rows):
            return separator
    heading = any("," in line and re.search("[A-Za-z][A-Za-z0-9]", line) for line in lines[:200])
    if rows and all(re.fullmatch("[01xX](?:,[01xX])+", row) for row in rows):
        return ","  # levels of inputs
    numbers = [row for row in rows if all(map(is_number, row.split()))]
    if numbers and len(numbers) * 2 > len(rows) and not heading:
        # 1 0,25 are two numbers, and 0,25 in a column of its own is a single one.
        parts = [row.split() for row in numbers]
        if any(part.endswith(",") for row in parts for part in row):
            return ","
        if sum(len(row) > 1 for row in parts) * 2 > len(parts):
            return " "
        # 0,25 below 1,5 is no decimal comma: times go on.
        values = [float(row[0].replace(",", ".")) for row in parts]
        return ";" if values == sorted(values) or "," not in numbers[0] else ","
    blanks = [row for row in rows if len(row.split()) > 1 and "," not in row]
    values_only = sum(all(map(is_value, row.split())) for row in blanks)
    return " " if len(blanks) * 2 > len(rows) and values_only * 2 > len(blanks) else ","


def split_line(line: str, separator: str) -> list[str]:
    """Split a line; quotes hold a value together."""
    if separator == " ":
        # A heading has names of several words: two blanks or more part them.
        parts = line.split()
        return parts if all(map(is_value, parts)) else re.split(r" {2,}|\t", line.strip())
    if '"' in line and len(line) < 100_000:
        (parts,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
        return [part.strip().strip('"').strip() for part in parts]
    return [part.strip() for part in line.split(separator)]
