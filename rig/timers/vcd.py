"""Value change dumps (IEEE 1364, clause 18), as logic analysers write them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rig.timers.events import MAX_EVENTS, TimerEvent

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.timers.problems import ProblemList

_SCALE = re.compile(r"\$timescale\s+(.{0,40}?)\s*(?:\$end|$)")
_ACCEPTED = re.compile(r"(10{0,2})\s*([munp]?)s")
_WIRE = re.compile(r"\$var\s+\w+\s+1\s+(\S+)\s+(\S+)")
"""A wire of one bit: ``$var wire 1 ! D0``."""
LONGEST = 30
"""Digits of a time: more would be no number that a computer reads at once."""
_PS = {"": 10**12, "m": 10**9, "u": 10**6, "n": 10**3, "p": 1}


def is_vcd(head: list[str]) -> bool:
    """Whether a file begins as a value change dump does."""
    first = next((line.strip() for line in head if line.strip()), "")
    return first.startswith(("$date", "$version", "$timescale", "$comment", "$scope", "$var"))


def read_vcd(
    lines: Iterator[str], problems: ProblemList
) -> tuple[list[TimerEvent], dict[str, str], int]:
    """Read the changes of all wires of one bit.

    Returns
    -------
    list of TimerEvent, dict, int
        Changes, the level that each wire begins with, and the unit of time in ps.
    """
    numbered, head = enumerate(lines, 1), ""
    for _, line in numbered:
        head += line[:200] + " "
        if "$enddefinitions" in line or len(head) > 1_000_000:
            break
    names, unit, time, stamp = dict(_WIRE.findall(head)), _read_scale(head, problems), 0, 0
    first: dict[str, str] = {}
    current: dict[str, tuple[str, int]] = {}
    events: list[TimerEvent] = []
    for number, line in numbered:
        for word in line.split() if not line.startswith("$comment") else ():
            if word[0] == "#" and word[1:].isdecimal():
                if len(word) > LONGEST:
                    problems.reject(number, 1, "time", word, "a time that a drop can have")
                    continue
                last, time, stamp = time, int(word[1:]) * unit, number
                if time < last:
                    problems.add(number, 1, "time", "backwards", text=word)
            elif word[0] in "01" and word[1:] in names:
                name, state = names[word[1:]], "high" if word[0] == "1" else "low"
                before, since = current.get(name, (state, -1))
                if before != state:
                    events.append(TimerEvent(time, name, state, stamp))
                    if since == time:
                        accepted = "a change: this wire has another value at this time already"
                        problems.reject(number, 1, name, word, accepted)
                first.setdefault(name, state)
                current[name] = state, time
        if len(events) > MAX_EVENTS:
            problems.refuse(number, 1, "too_many_events", limit=MAX_EVENTS)
    return events, first, unit


def _read_scale(head: str, problems: ProblemList) -> int:
    """Return the unit of time, ps."""
    stated = _SCALE.search(head)
    scale = _ACCEPTED.fullmatch(stated[1]) if stated else None
    if stated is None:
        problems.add(1, 1, "$timescale", "no_rate", lacks="a $timescale")
    elif scale is None:
        problems.reject(1, 1, "$timescale", stated[1], "a unit of time: 1, 10 or 100 s to ps")
    return int(scale[1]) * _PS[scale[2]] if scale else 0
