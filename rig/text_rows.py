"""Texts that the program is made from, each a file beside the module that reads it.

In a table, what begins with ``#`` explains it to whoever edits it.
"""

import os
from functools import cache


def read_text(module: str, name: str = "") -> str:
    """Return a text.

    Parameters
    ----------
    module
        The ``__file__`` of the module.
    name
        Name of the file; by default that of the module, with the ending ``.txt``.
    """
    folder, file = os.path.split(module)
    place = os.path.join(folder, name or file.replace(".py", ".txt"))  # noqa: PTH118
    with open(place, encoding="utf-8") as text:  # noqa: PTH123 - pathlib takes 5 ms
        return text.read()


def read_paragraphs(module: str, name: str = "") -> list[list[str]]:
    """Return the lines of each paragraph of a table; arguments as for `read_text`."""
    paragraphs = read_text(module, name).strip().split("\n\n")
    return [paragraph.splitlines() for paragraph in paragraphs if paragraph[0] != "#"]


@cache
def read_rows(module: str, name: str = "", mark: str | None = "|") -> list[list[str]]:
    """Return the rows of a table, one a line, by cells without the blanks around them.

    Parameters
    ----------
    module, name
        As for `read_text`.
    mark
        What parts the cells; if `None`, blanks.
    """
    lines = read_text(module, name).splitlines()
    rows = (line.split(mark) for line in lines if line and line[0] != "#")
    return [[*map(str.strip, row)] for row in rows]
