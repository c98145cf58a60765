"""Value change dumps (IEEE 1364, clause 18), as logic analysers write them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rig.timers.passages import Passage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.timers.problems import ProblemList

_SCALE = re.compile(r"(1|10|100)\s*(s|ms|us|ns|ps|fs)")
LONGEST = 30
"""Digits of a time: more would be no number that a computer reads at once."""
_PS = {"s": 10**12, "ms": 10**9, "us": 10**6, "ns": 10**3, "ps": 1, "fs": 0}


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
    names: dict[str, str] = {}
    unit, time = 0, 0
    first: dict[str, bool] = {}
    current: dict[str, bool] = {}
    changed: dict[str, int] = {}
    passages: list[Passage] = []
    text, skipping = "", False
    for number, line in enumerate(lines, 1):
        for word in line.split():
            if word == "$end":
                _note_wire(text, names)
                if text.startswith("$timescale"):
                    match = _SCALE.search(text)
                    unit = int(match[1]) * _PS[match[2]] if match else 0
                    if not unit:
                        scale = text[10:].strip()
                        problems.reject(number, 1, "$timescale", scale, "a unit of time")
                        return [], {}, 0
                text, skipping = "", False
            elif word in {"$date", "$version", "$timescale", "$comment", "$scope", "$var",
                           "$upscope", "$enddefinitions"}:  # fmt: skip
                text, skipping = word, True
            elif skipping:
                text += f" {word:.200}"
            elif word[0] == "#" and word[1:].isdecimal():
                time = _read_time(word, unit, time, number, problems)
            elif word[0] in "01" and word[1:] in names:
                name, high = names[word[1:]], word[0] == "1"
                if name in current and current[name] is not high:
                    if changed[name] == time:
                        accepted = "a change: this wire has another value at this time already"
                        problems.reject(number, 1, name, word, accepted)
                    passages.append(Passage(time, name, None, high, number))
                first.setdefault(name, high)
                current[name] = high
                changed[name] = time
    if not unit:
        problems.add(1, 1, "$timescale", "no_rate", lacks="a $timescale")
    return passages, first, unit


def _read_time(word: str, unit: int, last: int, line: int, problems: ProblemList) -> int:
    if len(word) > LONGEST:
        problems.reject(line, 1, "time", word, "a time that a drop can have")
        return last
    time = int(word[1:]) * unit
    if time < last:
        problems.add(line, 1, "time", "backwards", text=word)
    return time


def _note_wire(text: str, names: dict[str, str]) -> None:
    """Note a wire of one bit: ``$var wire 1 ! D0``."""
    parts = text.split()
    if parts[:1] == ["$var"] and len(parts) >= 5 and parts[2] == "1":
        names[parts[3]] = parts[4]
