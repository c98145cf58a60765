"""Value change dumps (IEEE 1364, clause 18) as a table: a row for each time, a column a wire."""

import itertools
from collections.abc import Iterator

from rig.timers.problems import ProblemList
from rig.timers.vocabulary import POWERS, form

BEGINNINGS = ("$date", "$version", "$timescale", "$comment", "$scope", "$var")
_LONGEST_HEAD = 5000
"""Lines, before which the wires have to be listed."""


def vcd_rows(lines: Iterator[tuple[int, str]], problems: ProblemList) -> Iterator[tuple[int, str]]:
    """Yield a heading, and a line of all levels for each time at which a level may change."""
    above = itertools.takewhile(lambda pair: "$enddefinitions" not in pair[1], lines)
    head = " ".join(line[:200] for _, line in itertools.islice(above, _LONGEST_HEAD))
    scale, names = form("time scale").search(head), dict(form("wire").findall(head))
    if scale is None or not names:
        problems.refuse(
            1, "no_rate", lacks="a $timescale of 1, 10 or 100 s to ps, or without a wire of one bit"
        )
    unit = f"e-{(POWERS | {'ps': 12})[scale[2]] - scale[1].count('0')}"
    yield 1, ",".join(["time (s)", *names.values()])
    at, time, levels, changes = 0, "0", dict.fromkeys(names, "x"), dict[str, str]()
    for number, word in _words(lines):
        value, wire = word[0], word[1:]
        if value == "#" and wire.isdecimal():
            if at or changes:
                levels |= changes
                yield at, ",".join([time + unit, *levels.values()])
            at, time, changes = number, wire, {}
        elif (wire in names and changes.setdefault(wire, value) != value) or (
            wire not in names and (value in "01" or (value == "#" and wire))
        ):
            accepted = "a time, or a wire of $var with one level at each time"
            problems.reject(number, 1, names.get(wire, "wire"), word, accepted)


def _words(lines: Iterator[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Yield times and changes of single bits: no comments, and no vectors with their wires."""
    is_comment = False
    for number, line in lines:
        for word in form("vector").sub("", line).split():
            is_comment = word == "$comment" or (is_comment and word != "$end")
            if not is_comment:
                yield number, word
    yield 0, "#0"  # ends the last time
