"""What words in a timer's file mean: the roles of headings, units of time, states of a beam."""

import re
import unicodedata
from collections.abc import Collection, Mapping
from functools import cache, lru_cache

from rig.text_rows import read_rows

POWERS = {"s": 0, "ms": 3, "0.1 ms": 4, "us": 6, "ns": 9}
"""Decimal power from seconds, by the unit's name."""
SYMBOLS = {0: "s", 3: "ms", 4: "0.1 ms", 6: "µs", 9: "ns", None: "an unknown unit"}
TIME_BASE = {"start", "step", "rate"}
"""Roles of settings that say the times of samples."""
LONGEST = 200
"""Characters: no cell, and no line of named values, is longer."""

_FAMILIES = {"blocked": "beam", "clear": "beam", "high": "signal", "low": "signal"}
"""Of what a state is; of others than these the file does not say."""
_STATES = "one", "zero", *_FAMILIES, "above", "below", "unknown", "undefined", "missing"
_KINDS = "number", "comma number", "clock", "timed", "input"
_DETAILS = "whole", "bit", "count", "fraction", "stamp"


@cache
def words() -> dict[str, frozenset[str]]:
    """Return the words of each role in `vocabulary.txt`."""
    rows = read_rows(__file__, "vocabulary.txt", ":")
    return {role: frozenset(map(str.strip, listed.split(","))) for role, listed in rows}


@cache
def form(name: str) -> re.Pattern[str]:
    """Return a form of `forms.txt`, or an expression in which such forms stand."""
    return re.compile(_expand(name))


@cache
def _expand(name: str) -> str:
    if name in words():
        known = sorted(map(re.escape, words()[name]), key=len, reverse=True)
        return f"(?i:{'|'.join(known)})"
    within = dict(read_rows(__file__, "forms.txt", " ; ")).get(name, name)
    return re.sub("<([a-z ]+)>", lambda match: f"(?:{_expand(match[1])})", within)


def without_accents(text: str) -> str:
    """Return a text in which accents are left out and compatible letters are the same."""
    parts = unicodedata.normalize("NFKD", text)
    return "".join(part for part in parts if not unicodedata.combining(part))


@lru_cache(10_000)
def normal(heading: str) -> str:
    """Return a heading in lower case, its words apart, without accents."""
    text = without_accents(heading[:LONGEST])
    text = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[0-9])(?=[A-Za-z])|_", " ", text)
    return " ".join(text.casefold().split())


@lru_cache(10_000)
def roles_in(heading: str) -> frozenset[str]:
    """Return the roles of which a heading has a word, and ``setting`` where it names one."""
    facts = {role for role in words() if form(f"<begin><{role}><end>").search(normal(heading))}
    is_setting = is_number(heading) or TIME_BASE & facts
    held = {"gate": find_label(heading, "gate"), "setting": is_setting}
    return frozenset(facts | facts_held(held))


@lru_cache(10_000)
def find_label(name: str, role: str) -> str:
    """Return the part of a heading that names an input, or a run, with its number."""
    match = form(f"{role} label").search(without_accents(name[:LONGEST]))
    return match[0] if match else ""


@lru_cache(10_000)
def unit_of(heading: str) -> str:
    """Return the unit that a heading ends with or has in brackets; nothing where it has none.

    Returns
    -------
    str
        A key of `POWERS`, ``v`` for volts and light, or the word in brackets.
    """
    text = normal(heading)
    units = form("bracketed unit").findall(text)
    last = form("last word").findall(text)
    pairs = ((word, unit) for word in (*units, *last) for unit in (*POWERS, "v"))
    known = (unit for word, unit in pairs if word in words()[f"unit {unit}"])
    return next(known, units[-1] if units else "")


@lru_cache(1000)
def state_of(text: str) -> str:
    """Return what a word says of a beam: a role among states, or nothing.

    Returns
    -------
    str
        ``one``, ``zero``, ``blocked``, ``clear``, ``high``, ``low``, ``above``, ``below`` (of what
        is measured), ``unknown``, ``undefined`` (of a level), ``missing``, or an empty text.
    """
    word = without_accents(text[:80]).casefold()
    word = re.sub(r"(?<=[01])[.,]0{0,30}(?:e[+-]?0{1,3})?$", "", word)
    return next((role for role in _STATES if word in words()[role]), "")


def is_number(text: str) -> bool:
    """Whether a text is a number with a decimal point."""
    return len(text) <= LONGEST and form("number").fullmatch(text) is not None


def is_measured(text: str) -> bool:
    """Whether a text is a number, a time with its unit or one of day, as no heading is."""
    return is_number(text) or form("stamp").fullmatch(text[:LONGEST]) is not None


@lru_cache(10_000)
def kinds_of(text: str) -> frozenset[str]:
    """Return everything that a cell may be; of words, such as a heading has, nothing.

    Returns
    -------
    frozenset of str
        ``number`` (with a decimal point) or ``comma number``; ``clock``, a time of day, perhaps
        with its date; ``timed``, a time with its unit; ``input``, a name with its number;
        ``state``, with what `state_of` says, and ``beam``, ``signal`` or ``level``: of what it is;
        and how it is written, a form of `forms.txt`.
    """
    if len(text) > LONGEST:
        return frozenset()
    state = state_of(text)
    kinds = {kind for kind in _KINDS if form(kind).fullmatch(text)}
    kinds |= {"state", state, _FAMILIES.get(state, "level")} if state else set()
    if not kinds or ("input" in kinds and "start" in roles_in(text)):
        return frozenset()
    return frozenset(kinds | {detail for detail in _DETAILS if form(detail).fullmatch(text)})


def facts_held(facts: Mapping[str, object]) -> set[str]:
    """Return what is true."""
    return {fact for fact, is_true in facts.items() if is_true}


def holds(rule: str, facts: Collection[str]) -> bool:
    """Whether facts fulfil a rule of a table: all that it names are there, those with ``-`` not."""
    return all((fact.lstrip("-") in facts) is (fact[0] != "-") for fact in rule.split())


def is_remark(line: str) -> bool:
    """Whether a line is marked as a remark."""
    return form("remark").match(line) is not None


def number_of(label: str) -> int | None:
    """Return the number in an input's name: 3 of D3, of ``Channel 3 (V)`` and of 3.0."""
    match = form("number of a label").search(label)
    return int(match[1]) if match else None
