"""Value change dumps (IEEE 1364, clause 18) as a table: a row for each level that changes."""

import itertools
from collections.abc import Iterator

from rig.timers.problems import ProblemList
from rig.timers.vocabulary import POWERS, form

BEGINNINGS = ("$date", "$version", "$timescale", "$comment", "$scope", "$var")
_LONGEST_HEAD = 5000
"""Lines, before which the wires have to be listed."""


def vcd_rows(lines: Iterator[tuple[int, str]], problems: ProblemList) -> Iterator[tuple[int, str]]:
    """Yield a heading, and a line for each change: its time, the wire or its bit, and the level.

    All lines of a time have the number of the line that says it.
    """
    above = itertools.takewhile(lambda pair: "$enddefinitions" not in pair[1], lines)
    head = " ".join(line[:200] for _, line in itertools.islice(above, _LONGEST_HEAD))
    scale, wires = form("time scale").search(head), form("wire").findall(head)
    if scale is None or not wires:
        problems.refuse(1, "no_rate", lacks="a $timescale of 1, 10 or 100 s to ps, or a wire")
    unit = f"e-{(POWERS | {'ps': 12})[scale[2]] - scale[1].count('0')}"
    bits = {
        code: [name] if size == "1" else [f"{name} {n}" for n in range(int(size))]
        for size, code, name in wires
    }
    yield 1, "time (s),gate,logic level"
    at, time, levels = 0, "0", dict[str, str]()
    words = _words(lines)
    for number, word in words:
        value, wire = word[0], word[1:]
        if value in "bBrRsS":  # of a vector, or no level at all
            value, (_, wire) = wire, next(words, (0, ""))
        if value == "#" and wire.isdecimal():
            at, time = number, wire
        elif wire in bits:
            for name, level in zip(bits[wire], value[::-1].ljust(99, "0"), strict=False):
                if levels.get(name) != level:
                    yield at, f"{time}{unit},{name},{level}"
                levels[name] = level
        elif word[0] in "01#" and word != "#":
            problems.reject(number, 1, "wire", word, "a time, or a level of a wire of $var")


def _words(lines: Iterator[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Yield times and changes, each with its line: no comments."""
    is_comment = False
    for number, line in lines:
        for word in line.split():
            is_comment = word == "$comment" or (is_comment and word != "$end")
            if not is_comment:
                yield number, word
