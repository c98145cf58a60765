"""Where in a CSV file something is wrong: lines and columns behind the csv module's back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.errors import InputError, Problem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

MAX_PROBLEMS = 50


class Lines:
    """Lines of a file without blank lines and comments, remembering the place.

    Attributes
    ----------
    number
        Line of the file at which the present record starts, from 1.
    consumed
        Number of lines the present record took.
    """

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines = enumerate(lines, start=1)
        self._text = ""
        self.number = 1
        self.consumed = 0

    def start_record(self) -> None:
        """Say that the next line begins a record."""
        self.consumed = 0

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        for number, text in self._lines:
            content = text.strip()
            if content and not content.startswith("#"):
                if not self.consumed:
                    self.number, self._text = number, text
                self.consumed += 1
                return text
        raise StopIteration

    def column(self, field: int) -> int:
        """Column (from 1) at which a value of the present record starts, spaces left out."""
        start, quoted = 0, False
        for position, character in enumerate(self._text):
            if character == '"':
                quoted = not quoted
            elif character == "," and not quoted:
                if field == 0:
                    break
                field -= 1
                start = position + 1
        rest = self._text[start:]
        return start + len(rest) - len(rest.lstrip()) + 1


class ProblemList:
    """Faults of one file; beyond the first `MAX_PROBLEMS` they are only counted."""

    def __init__(self, file: str) -> None:
        self.file = file
        self._problems: list[Problem] = []
        self._more = 0

    def add(self, line: int, column: int, key: str, message: str) -> None:
        """Note a fault."""
        if len(self._problems) < MAX_PROBLEMS:
            self._problems.append(Problem(self.file, line, column, key, message))
        else:
            self._more += 1

    def add_if_none(self, line: int, column: int, key: str, message: str) -> None:
        """Note a fault that only matters where there is no other."""
        if not self._problems:
            self.add(line, column, key, message)

    def raise_if_any(self, hint: str = "") -> None:
        """Raise what was noted.

        Raises
        ------
        InputError
            With all noted problems and a line that counts those left out.
        """
        if not self._problems:
            return
        message = "\n".join(map(str, self._problems))
        if self._more:
            message += f"\n{self.file}: and {self._more} more problems"
        raise InputError(message, hint, problems=self._problems)
