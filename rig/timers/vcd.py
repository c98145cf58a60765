"""Value change dumps (IEEE 1364, clause 18) as a table: a row for each time, a column a wire."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rig.timers.vocabulary import POWERS, form

if TYPE_CHECKING:
    from rig.timers.problems import ProblemList

_POWERS = POWERS | {"ps": 12}
BEGINNINGS = ("$date", "$version", "$timescale", "$comment", "$scope", "$var")
_LONGEST_HEAD = 1_000_000
"""Characters, before which the wires have to be listed."""


def vcd_rows(lines: Iterator[tuple[int, str]], problems: ProblemList) -> Iterator[tuple[int, str]]:
    """Yield a heading, and a line of all levels for each time at which a level may change."""
    head = ""
    for _, line in lines:
        head += line[:200] + " "
        if "$enddefinitions" in line or len(head) > _LONGEST_HEAD:
            break
    stated, names = form("time scale").search(head), dict(form("wire").findall(head))
    scale = form("scale").fullmatch(stated[1] if stated else "")
    if stated is None:
        problems.refuse(1, 1, "no_rate", lacks="a $timescale")
    if scale is None:
        problems.reject(1, 1, "$timescale", stated[1], "a unit of time: 1, 10 or 100 s to ps")
    elif not names:
        problems.add(1, 1, "", "no_edges")
    problems.raise_if_any()
    power = _POWERS[scale[2]] - scale[1].count("0") if scale else 0
    yield 0, ",".join(["time (s)", *names.values()])
    at, time, levels, changed = 0, "0", dict.fromkeys(names, "x"), set[str]()
    for number, line in lines:
        for word in line.split() if not line.startswith("$comment") else ():
            if word[0] == "#" and word[1:].isdecimal():
                if at or changed:
                    yield at, ",".join([f"{time}e-{power}", *levels.values()])
                at, time, changed = number, word[1:], set()
            elif word[0] in "01xzXZ" and word[1:] in levels:
                if word[1:] in changed and levels[word[1:]] != word[0]:
                    accepted = "a change: this wire has another value at this time already"
                    problems.reject(number, 1, names[word[1:]], word, accepted)
                changed.add(word[1:])
                levels[word[1:]] = word[0]
    yield at, ",".join([f"{time}e-{power}", *levels.values()])
