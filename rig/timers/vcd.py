"""Value change dumps (IEEE 1364, clause 18), as logic analysers write them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rig.timers.passages import Passage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.timers.problems import ProblemList

_SCALE = re.compile(r"\$timescale\s+(1|10|100)\s*(s|ms|us|ns|ps)\s+\$end")
_STATED = re.compile(r"\$timescale\s+(.{0,40}?)\s*(?:\$end|$)")
_WIRE = re.compile(r"\$var\s+\w+\s+1\s+(\S+)\s+(\S+)")
"""A wire of one bit: ``$var wire 1 ! D0``."""
LONGEST = 30
"""Digits of a time: more would be no number that a computer reads at once."""
_PS = {"s": 10**12, "ms": 10**9, "us": 10**6, "ns": 10**3, "ps": 1}


def is_vcd(lines: Sequence[str]) -> bool:
    """Whether a file begins as a value change dump does."""
    first = next((line.strip() for line in lines if line.strip()), "")
    return first.startswith(("$date", "$version", "$timescale", "$comment", "$scope", "$var"))


def read_vcd(
    lines: Sequence[str], problems: ProblemList
) -> tuple[list[Passage], dict[str, bool], int]:
    """Read the changes of all wires of one bit.

    Returns
    -------
    list of Passage, dict, int
        Changes, the level that each wire begins with, and the unit of time in ps.
    """
    end = next((n for n, line in enumerate(lines) if "$enddefinitions" in line), len(lines))
    head = " ".join(line[:200] for line in lines[: end + 1])
    names, scale, stated = dict(_WIRE.findall(head)), _SCALE.search(head), _STATED.search(head)
    if scale is None and stated is not None:
        problems.reject(1, 1, "$timescale", stated[1], "a unit of time: 1, 10 or 100 s to ps")
    elif scale is None:
        problems.add(1, 1, "$timescale", "no_rate", lacks="a $timescale")
    unit, time, stamp = int(scale[1]) * _PS[scale[2]] if scale else 0, 0, 0
    first: dict[str, bool] = {}
    current: dict[str, tuple[bool, int]] = {}
    passages: list[Passage] = []
    for number, line in enumerate(lines[end + 1 :], end + 2):
        for word in line.split() if not line.startswith("$comment") else ():
            if word[0] == "#" and word[1:].isdecimal():
                if len(word) > LONGEST:
                    problems.reject(number, 1, "time", word, "a time that a drop can have")
                    continue
                last, time, stamp = time, int(word[1:]) * unit, number
                if time < last:
                    problems.add(number, 1, "time", "backwards", text=word)
            elif word[0] in "01" and word[1:] in names:
                name, high = names[word[1:]], word[0] == "1"
                before, since = current.get(name, (high, -1))
                if before is not high and since == time:
                    accepted = "a change: this wire has another value at this time already"
                    problems.reject(number, 1, name, word, accepted)
                if before is not high:
                    passages.append(Passage(time, name, None, high, stamp))
                first.setdefault(name, high)
                current[name] = high, time
    return passages, first, unit
