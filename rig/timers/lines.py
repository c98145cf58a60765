"""Lines of a text file in any usual encoding, read one after the other in little memory."""

import codecs
from collections.abc import Generator
from pathlib import Path
from typing import Any

from rig.files import require_file
from rig.timers.problems import ProblemList, refusal

MAX_BYTES = 200_000_000
LONGEST_LINE = 20_000
"""Characters: no text that people or timers write has a longer one."""
_START = 4096
"""Bytes that show the encoding, or that this is no text."""


def _decode_as_windows(fault: Any) -> tuple[str, int]:
    """Read bytes that are no UTF-8 as Windows writes them, wherever they stand."""
    return fault.object[fault.start : fault.end].decode("cp1252", "replace"), fault.end


codecs.register_error("windows", _decode_as_windows)


def read_lines(path: str | Path) -> Generator[str]:
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
            problems.refuse(1, "too_large", size_mb=size / 1e6, limit_mb=MAX_BYTES / 1e6)
        with Path(path).open("rb") as file:
            start = file.read(_START)
        has_mark = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        zeros = [start[n::2].count(0) * 3 > len(start) for n in (0, 1)]
        halves = {(True, False): "utf-16-be", (False, True): "utf-16-le"}
        encoding = "utf-16" if has_mark else halves.get((zeros[0], zeros[1]), "utf-8-sig")
        if encoding == "utf-8-sig" and b"\0" in start:
            problems.refuse(1, "not_text")
        with Path(path).open(encoding=encoding, errors="windows") as stream:
            lines = iter(lambda: stream.readline(LONGEST_LINE), "")
            for number, line in enumerate(lines, 1):
                if len(line) == LONGEST_LINE:
                    problems.refuse(number, "not_text")
                yield line.rstrip("\n")
    except OSError as error:
        raise refusal(str(path), "unreadable", text=error.strerror or str(error)) from error


def is_cut(path: str | Path) -> bool:
    """Whether a file may end in the middle of its last number."""
    with Path(path).open("rb") as stream:
        stream.seek(max(0, Path(path).stat().st_size - _START))
        *_, before, last = map(bytes.strip, [b"", *stream.read().replace(b"\0", b"").split(b"\n")])
    return 0 < len(last) < len(before)
