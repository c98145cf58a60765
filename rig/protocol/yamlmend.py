"""What a text that is no YAML lacks: a quote, a bracket, a colon, a comma, an indent.

The parser says where it stopped, in the words of its grammar. What people need is the smallest
change that lets it go on; so the mistakes of ``yamlmend.txt`` are looked for around the place, and
the parser itself judges each change.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from itertools import groupby, islice, product
from pathlib import Path
from typing import NamedTuple

import yaml

from rig.units import quoted

MOST_PARSED = 150_000
"""Characters parsed in search of a change: about a second, and fifty changes of a page."""
_CLOSING = {"[": "]", "{": "}"}
_BRACKET_OR_QUOTED = re.compile(r"\"[^\"]*(?:\"|$)|'[^']*(?:'|$)|[\[\]{}]")
_QUOTE = re.compile(r"\"[^\"\n]*\"|'[^'\n]*'|(?<![^\s\[{,:])(?P<open>[\"'])[^\n]*")
NOT_READABLE = "this line cannot be read from here on: see its quotes, brackets, colons and indent"
_TABLE = Path(__file__).with_suffix(".txt").read_text("utf-8").strip().split("\n\n")[1]
_MISTAKES = [re.split(r" +\| ", row, maxsplit=3) for row in _TABLE.split("\n")]
_NEW = {"nothing": "", "blank": " ", "colon": ": "}
Mend = tuple[int, str, str]
"""A place in a text, what is wrong there, and the text as it should be."""


class _Span(NamedTuple):
    """Where to look for a mistake: the place that its sentence points to, and what closes there."""

    begin: int
    end: int
    anchor: int | None = None
    close: str = ""


def explain(text: str, error: yaml.MarkedYAMLError) -> tuple[int, str]:
    """Return where a text stops being YAML, and what is missing or too much there.

    Parameters
    ----------
    text
        As it was parsed.
    error
        What the parser raised.

    Returns
    -------
    tuple of int and str
        An index in `text`, and a sentence.
    """
    stop = min(_stop(error), len(text))
    begin = error.context_mark.index if error.context_mark else stop
    at = _visible(text, stop)
    farther = None
    mends = _list_mends(text, at, _list_spans(text, stop, at, begin))
    for place, message, mended in islice(mends, MOST_PARSED // (len(text) + 1)):
        reach = _reach(mended)
        if reach is None:
            return place, message
        if farther is None and reach > _line_end(text, stop):
            farther = place, message
    return farther or (at, NOT_READABLE)


def _reach(text: str) -> int | None:
    """Return how far the parser gets; `None` if it meets no error."""
    try:
        for _ in yaml.parse(text, Loader=yaml.SafeLoader):
            pass
    except yaml.MarkedYAMLError as error:
        return _stop(error)
    except (yaml.YAMLError, ValueError, ArithmeticError, LookupError):
        return 0
    return None


def _stop(error: yaml.MarkedYAMLError) -> int:
    mark = error.problem_mark or error.context_mark
    return mark.index if mark else 0


def _list_spans(text: str, stop: int, at: int, begin: int) -> dict[str, list[_Span]]:
    """Return the places of the table: around where the parser stopped, and what it began there.

    Parameters
    ----------
    stop, at
        Where it stopped, and the visible character next to that.
    begin
        Where that began which it could not finish.
    """
    start, end, first = _line_start(text, at), _line_end(text, at), _line_start(text, begin)
    before = _line_start(text, max(first - 1, 0))
    lines = (first, before, start, _line_start(text, max(start - 1, 0)))
    quotes = _QUOTE.finditer(text, 0, stop)
    opened: list[int] = []
    for mark in _BRACKET_OR_QUOTED.finditer(text, first, at):
        if mark.group() in _CLOSING:
            opened.append(mark.start())
        elif mark.group() in _CLOSING.values() and opened:
            opened.pop()
    if text[begin : begin + 1] in _CLOSING and begin not in opened:
        opened.insert(0, begin)

    def behind(opening: int, close: str) -> _Span:
        return _Span(opening + 1, _line_end(text, opening), opening, close)

    brackets = [behind(bracket, _CLOSING[text[bracket]]) for bracket in opened[-1:]]
    return {
        "stop": [_Span(at, at + 1)],
        "rest": [_Span(at, end)],
        "before": [_Span(start, at + 1)],
        "line": [_Span(start, end, at)],
        "lines": [_Span(line, _line_end(text, line)) for line in dict.fromkeys(lines)],
        "around": [_Span(before, end)],
        "quote": [behind(quote.start(), quote["open"]) for quote in quotes if quote["open"]],
        "bracket": [bracket._replace(end=at + 1) for bracket in brackets],
        "behind": brackets,
    }


def _list_mends(text: str, at: int, spans: dict[str, list[_Span]]) -> Iterator[Mend]:
    """List changes that could let the parser go on, the likeliest first."""
    for where, rows in groupby(_MISTAKES, key=lambda row: row[0].split()[0]):
        if where == "indents":
            yield from _indents(text, at)
            continue
        for span, (place, pattern, new, sentence) in product(spans[where], [*rows]):
            for match in _find(pattern, text, span, place.split()[1], at):
                (begin, end), old, groups = match.span("old"), match["old"], match.re.groupindex
                anchor = begin if span.anchor is None else span.anchor
                pointed = match.start("at") if "at" in groups else anchor
                word = match["word"] if "word" in groups else _word(text, pointed)
                character = quoted(text[pointed : pointed + 1])
                words = {"old": quoted(old), "word": quoted(word), "character": character}
                message = sentence.format(**words, close=span.close, opened=text[anchor])
                added = _NEW | {"close": span.close, "quoted": json.dumps(old, ensure_ascii=False)}
                yield pointed, message, text[:begin] + added.get(new, new) + text[end:]


def _find(pattern: str, text: str, span: _Span, order: str, at: int) -> list[re.Match[str]]:
    """Return where a mistake may be: only ``here``, the one ``near`` the stop first, or all."""
    matches = [*re.compile(pattern, re.MULTILINE).finditer(text, span.begin, span.end)]
    if order == "near":
        matches.sort(key=lambda match: abs(match.start("old") - at))
    return [match for match in matches if order != "here" or match.start() == span.begin]


def _word(text: str, index: int) -> str:
    return re.split(r"[\s:,\]}]", text[index : index + 40])[0] or text[index : index + 1]


def _indents(text: str, at: int) -> Iterator[Mend]:
    """Give a line, or the one before it, the blanks and the hyphen of a line above or below."""
    line_start = _line_start(text, at)
    before = _line_start(text, max(line_start - 1, 0))
    starts = [n + 1 for n in range(line_start) if text[n] == "\n"]
    for start in dict.fromkeys((before, line_start)):
        indent = len(_lead(text, start).removesuffix("- "))
        leads = {_lead(text, line): line for line in (0, *starts) if line != start}
        for lead, line in reversed(leads.items()):
            if lead == _lead(text, start) or text[line + len(lead) : line + len(lead) + 1] == "#":
                continue
            number = text.count("\n", 0, line) + 1
            if lead.endswith("- "):
                message = f"a hyphen is missing: begin with {quoted(lead)}, as line {number} does"
            else:
                blanks = "1 blank" if indent == 1 else f"{indent} blanks"
                message = f"begins with {blanks}: {len(lead)} are needed, as on line {number}"
            yield start + indent, message, text[:start] + lead + text[start + indent :]


def _lead(text: str, start: int) -> str:
    """Return the blanks that a line begins with, and the hyphen of an item of a list."""
    lead = re.compile(r" *(?:- )?").match(text, start)
    return lead.group() if lead else ""


def _line_start(text: str, index: int) -> int:
    return text.rfind("\n", 0, index) + 1


def _line_end(text: str, index: int) -> int:
    end = text.find("\n", index)
    return len(text) if end < 0 else end


def _visible(text: str, index: int) -> int:
    """Return an index, or at the end of a text that of its last character."""
    return index if text[index:].strip() else max(len(text.rstrip()) - 1, 0)
