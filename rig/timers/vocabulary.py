"""What words in a timer's file mean: the roles of headings, units of time, states of a beam."""

from __future__ import annotations

import re
import unicodedata
from functools import cache, lru_cache
from pathlib import Path

POWERS = {"s": 0, "ms": 3, "us": 6, "ns": 9}
"""Decimal power from seconds, by the unit's name."""
SYMBOLS = {0: "s", 3: "ms", 6: "µs", 9: "ns"}
_BRACKETED = re.compile(r"[\[({]\s*([^\W\d_]{1,20})\s*[\])}]")
_LAST = re.compile(r"(?:^|[\W_])([^\W\d_]{1,20})\W*$")


@cache
def words() -> dict[str, frozenset[str]]:
    """Return the words of each role in `vocabulary.txt`."""
    text = Path(__file__).with_name("vocabulary.txt").read_text("utf-8")
    rows = (line.split(":", 1) for line in text.splitlines() if line and line[0] != "#")
    return {role: frozenset(map(str.strip, listed.split(","))) for role, listed in rows}


@cache
def _pattern(role: str) -> re.Pattern[str]:
    listed = "|".join(sorted(map(re.escape, words()[role]), key=len, reverse=True))
    return re.compile(rf"(?<![^\W\d_])(?:{listed})(?![^\W\d_])")


def without_accents(text: str) -> str:
    """Return a text in which accents are left out and compatible letters are the same."""
    parts = unicodedata.normalize("NFKD", text)
    return "".join(part for part in parts if not unicodedata.combining(part))


@cache
def normal(heading: str) -> str:
    """Return a heading in lower case, its words apart, without accents."""
    text = re.sub(
        r"(?<=[a-z])(?=[A-Z])|(?<=[0-9])(?=[A-Za-z])", " ", without_accents(heading[:200])
    )
    return " ".join(text.replace("_", " ").casefold().split())


def has_role(heading: str, role: str) -> bool:
    """Whether a heading has a word of a role."""
    return _pattern(role).search(normal(heading)) is not None


@cache
def unit_of(heading: str) -> str:
    """Return the unit that a heading ends with or has in brackets; nothing where it has none.

    Returns
    -------
    str
        A key of `POWERS`, ``v`` for volts and light, or the word in brackets.
    """
    text = normal(heading)
    named = _BRACKETED.findall(text)
    last = _LAST.search(text)
    for word in (*named, *([last[1]] if last else ())):
        for unit in (*POWERS, "v"):
            if word in words()[f"unit {unit}"]:
                return unit
    return named[-1] if named else ""


@lru_cache(1000)
def state_of(text: str) -> str:
    """Return what a word says of a beam: a role among states, or nothing.

    Returns
    -------
    str
        ``one``, ``zero``, ``blocked``, ``clear``, ``high``, ``low``, or an empty text.
    """
    word = re.sub(r"(?<=[01])[.,]0{0,30}$", "", without_accents(text[:80]).casefold())
    roles = ("one", "zero", "blocked", "clear", "high", "low")
    return next((role for role in roles if word in words()[role]), "")


def number_of(label: str) -> int | None:
    """Return the number in an input's name: 3 of D3, of ``Channel 3 (V)`` and of 3."""
    match = re.search(r"([0-9]{1,6})$", re.sub(r"[\[(].*", "", label).strip())
    return int(match[1]) if match else None


def formats() -> list[list[str]]:
    """Return the rows of `formats.txt`: name, what it is recognised by, what differs, example."""
    text = Path(__file__).with_name("formats.txt").read_text("utf-8")
    rows = [line for line in text.splitlines() if line and line[0] != "#"]
    return [[cell.strip() for cell in row.split("|")] for row in rows]


def recognise_format(lines: list[str]) -> str:
    """Return the name of the maker's format that the first lines are like; nothing if of none."""
    head = "\n".join(line[:200] for line in lines[:40]).casefold()
    for name, marks, *_ in formats():
        if marks and all(mark.strip().casefold() in head for mark in marks.split("+")):
            return name
    return ""
