"""Tables as data loggers write them: their separator, their heading, their cells."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import InputError
from rig.session.edges_csv import HEADER, MAX_BYTES

if TYPE_CHECKING:
    import os

SEPARATORS = ("\t", ";", ",")
_HEAD = 40  # lines in which a heading is looked for
BLOCKED = {"1", "blocked", "block", "true", "closed", "dark", "on"}
CLEAR = {"0", "unblocked", "unblock", "clear", "false", "open", "off"}
TIME = re.compile(
    r"\b(?:time|times|zeit|temps|tiempo|tempo|tijd|tid)\b|^t$|^t\s*[\[(]", re.IGNORECASE
)
STATE = re.compile(r"state|status|blocked|zustand|[ée]tat|estado", re.IGNORECASE)
_DERIVED = re.compile(r"dist|pos|vel|speed|accel|count|height|^[dvasx]$", re.IGNORECASE)
NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,2})?")


class TableCell(NamedTuple):
    """A value and the column, from 1, at which it stands."""

    column: int
    text: str


Row = tuple[int, list[TableCell]]


def is_logger_table(path: str | os.PathLike[str]) -> bool:
    """Whether a file looks like a data logger's table of when a beam darkened.

    That is one with times and states, or with times and nothing but what is derived from them, or
    numbers alone.
    """
    lines = lines_of(path)
    first = next((one for one in lines if one.strip() and not one.lstrip().startswith("#")), "")
    if first.lower().replace(" ", "").startswith(",".join(HEADER[:2])):
        return False
    separator = separator_of(lines)
    rows = [(number, cells_of(line, separator)) for number, line in enumerate(lines[:_HEAD], 1)]
    heading = heading_of(rows)
    if heading is None:
        data = (cells for _, cells in rows if has_number(cells, separator))
        return len(next(data, [])) in {1, 2}
    known = (TIME, STATE, _DERIVED)
    texts = [cell.text for cell in heading[1] if cell.text]
    named = [[pattern.search(text) is not None for pattern in known] for text in texts]
    return any(state for _, state, _ in named) or all(map(any, named))


def lines_of(path: str | os.PathLike[str]) -> list[str]:
    """Read a text file, UTF-8 or UTF-16.

    Raises
    ------
    InputError
        A file that cannot be read, or is far too large.
    """
    try:
        size = Path(path).stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"{path}:1:1: {size / 1e6:.0f} MB is more than {MAX_BYTES / 1e6:.0f} MB",
                "is it the right file?",
            )
        text = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    # Some programs on Windows export UTF-16.
    encoding = "utf-16" if text[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig"
    return text.decode(encoding, errors="replace").splitlines()


def separator_of(lines: list[str]) -> str:
    """The first of tab, semicolon and comma that most lines with a number have."""
    rows = [line for line in lines if re.search("[0-9]", line)]
    for separator in SEPARATORS[:2]:
        if sum(separator in line for line in rows) * 2 > len(rows):
            return separator
    # 0,5 in a single column is a number; 0,1 with a heading of two columns is two of them.
    heading = next((line for line in lines if TIME.search(line)), None)
    if heading is not None and "," not in heading:
        return ";"
    if heading is None and rows and all(NUMBER.fullmatch(row.strip()) for row in rows):
        return ";"
    return ","


def cells_of(line: str, separator: str) -> list[TableCell]:
    """Split a line; quotes hold a value together."""
    found, start, quoted = [], 0, False
    for position, character in enumerate([*line, separator]):
        if position < len(line) and character == '"':
            quoted = not quoted
        elif position == len(line) or (character == separator and not quoted):
            raw = line[start:position]
            text = raw.strip()
            lead = len(raw) - len(raw.lstrip())
            found.append(TableCell(start + lead + 1, text.strip('"').strip()))
            start = position + 1
    return found


def is_data(cells: list[TableCell], separator: str) -> bool:
    """Whether a row holds numbers and states only."""
    texts = [cell.text for cell in cells if cell.text]
    numbers = [text for text in texts if is_number(text, separator)]
    return bool(numbers) and all(
        text in numbers or text.lower() in BLOCKED | CLEAR for text in texts
    )


def has_number(cells: list[TableCell], separator: str) -> bool:
    """Whether any cell is a number and nothing else."""
    return any(is_number(cell.text, separator) for cell in cells)


def is_number(text: str, separator: str) -> bool:
    """Whether a text is a number; decimals have a comma only where none separates cells."""
    return NUMBER.fullmatch(text) is not None and not (separator == "," and "," in text)


def heading_of(headings: list[Row]) -> Row | None:
    """The row that names most times and states: below it may stand symbols and units."""

    def names(row: Row) -> tuple[int, int]:
        texts = [cell.text for cell in row[1]]
        states = sum(STATE.search(text) is not None for text in texts)
        return sum(TIME.search(text) is not None for text in texts), states

    named = [row for row in headings if names(row)[0]]
    return max(named, key=lambda row: sum(names(row)), default=None)
