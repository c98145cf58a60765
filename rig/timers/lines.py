"""Lines of a text file in any usual encoding, read one after the other in little memory."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from rig.files import require_file
from rig.timers.problems import ProblemList, refusal
from rig.timers.vocabulary import read_rows

MAX_BYTES = 200_000_000
LONGEST_LINE = 20_000
"""Characters: no text that people or timers write has a longer one."""
_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_START = 4096
"""Bytes that show the encoding, or another kind of file."""


def read_lines(path: str | Path) -> Iterator[str]:
    """Yield the lines of a text file: UTF-8, UTF-16 with its mark and without, or Windows'.

    Raises
    ------
    InputError
        A file that cannot be read (so a pipe: a file is read more than once), is far too large,
        or is not text.
    """
    problems = ProblemList(str(path))
    try:
        require_file(path)
        size = Path(path).stat().st_size
        if size > MAX_BYTES:
            problems.refuse(1, 1, "too_large", size_mb=size / 1e6, limit_mb=MAX_BYTES / 1e6)
        encoding = _find_encoding(Path(path), problems)
        with Path(path).open(encoding=encoding, errors="replace") as stream:
            read_line = partial(stream.readline, LONGEST_LINE)
            for number, line in enumerate(iter(read_line, ""), 1):
                if len(line) == LONGEST_LINE:
                    problems.refuse(number, 1, "not_text")
                yield line.rstrip("\n")
    except OSError as error:
        raise refusal(str(path), "unreadable", text=error.strerror or str(error)) from error


def is_cut(path: str | Path) -> bool:
    """Whether a file may end in the middle of its last number."""
    with Path(path).open("rb") as stream:
        stream.seek(-min(_START, Path(path).stat().st_size), os.SEEK_END)
        lines = stream.read().replace(b"\0", b"").split(b"\n")[-2:]
    before, last = (re.search(rb"[.,](\d*)\W*$", line) for line in (lines[0], lines[-1]))
    return before is not None and last is not None and len(last[1]) < len(before[1])


def find_kind(path: str | Path) -> str:
    """Return what a file is that is no timer's; nothing where that is not known."""
    with Path(path).open("rb") as stream:
        start = stream.read(_START).removeprefix(b"\xef\xbb\xbf").lstrip()
    kinds = dict(read_rows("kinds.txt", " ; "))
    return next((x for x in kinds if re.match(kinds[x].encode(), start, re.DOTALL)), "")


def _find_encoding(path: Path, problems: ProblemList) -> str:
    with path.open("rb") as stream:
        start = stream.read(_START)
    zeros = [start[n::2].count(0) * 3 > len(start) for n in (0, 1)]
    if start[:2] in _MARKS or sum(zeros) == 1:
        return _MARKS.get(start[:2], "utf-16-be" if zeros[0] else "utf-16-le")
    if b"\0" in start:
        problems.refuse(1, 1, "not_text")
    try:
        with path.open(encoding="utf-8") as text:
            while text.read(1 << 20):
                pass
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"
