"""Tables that the program is made from: a text file beside the module that reads it, a row a line.

A line that begins with ``#`` explains the table to whoever edits it.
"""

from __future__ import annotations

from pathlib import Path


def read_rows(module: str, name: str = "", mark: str | None = "|") -> list[list[str]]:
    """Return the rows of a table by cells, without the blanks around them.

    Parameters
    ----------
    module
        Its ``__file__``.
    name
        Name of the table; by default that of the module, with the ending ``.txt``.
    mark
        What parts the cells; if `None`, blanks.
    """
    place = Path(module).with_name(name) if name else Path(module).with_suffix(".txt")
    lines = place.read_text("utf-8").splitlines()
    rows = (line.split(mark) for line in lines if line and line[0] != "#")
    return [[*map(str.strip, row)] for row in rows]
