"""Suggested corrections of invalid YAML: a quote, a bracket, a colon, a comma, an indent.

The parser reports where it stopped, in terms of its grammar. Users need the smallest change with
which it continues. So the mistakes of ``yamlmend.txt`` are searched for around that place, and each
change is tested by the parser.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from itertools import groupby, islice, product
from typing import NamedTuple

import yaml

from rig.text_rows import read_paragraphs
from rig.units import quote

MOST_PARSED = 150_000
"""Most characters parsed in a search: about a second, or fifty changes of a page."""
_CLOSING = {"[": "]", "{": "}"}
_BRACKET_OR_QUOTED = re.compile(r"\"[^\"]*(?:\"|$)|'[^']*(?:'|$)|[\[\]{}]")
_QUOTE = re.compile(r"\"[^\"\n]*\"|'[^'\n]*'|(?<![^\s\[{,:])(?P<open>[\"'])[^\n]*")
NOT_READABLE = "this line cannot be read from here on: see its quotes, brackets, colons and indent"
_MISTAKES = [re.split(r" +\| ", row, maxsplit=3) for row in read_paragraphs(__file__)[0]]
_COMPOSED = {
    "but found another document": "a second document; a file has one protocol",
    "second occurrence": "an anchor of this name is given above; choose another name",
    "found undefined alias": "no anchor stands before the alias",
}
"""What PyYAML's composer refuses, and in which words."""
_NEW = {"nothing": "", "blank": " ", "colon": ": "}
Mend = tuple[int, str, str]
"""A place in a text, what is wrong there, and the text as it should be."""


class _Span(NamedTuple):
    """Span of a search for a mistake, with the place of its message and the closing character."""

    begin: int
    end: int
    anchor: int | None = None
    close: str = ""


def explain(text: str, error: yaml.MarkedYAMLError) -> tuple[int, str]:
    """Return where a text stops being YAML, and what is missing or too much there.

    Parameters
    ----------
    text
        The parsed text.
    error
        The parser's error.

    Returns
    -------
    tuple of int and str
        An index in `text`, and a sentence.
    """
    stop = min(_stop(error), len(text))
    if isinstance(error, yaml.composer.ComposerError):
        words, mark, name = str(error.problem).partition(" '")
        return stop, f"{_COMPOSED.get(words, words)}{mark}{name}"
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
    """Return the index at which the parser stops; `None` without an error."""
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
    """Return the spans of the table: around the stop of the parser, and of the open construct.

    Parameters
    ----------
    stop, at
        Index at which it stopped, and the visible character next to that.
    begin
        Index of the construct that it could not finish.
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
    """Yield changes with which the parser might continue, the likeliest first."""
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
                character = quote(text[pointed : pointed + 1])
                words = {"old": quote(old), "word": quote(word), "character": character}
                message = sentence.format(**words, close=span.close, opened=text[anchor])
                added = _NEW | {"close": span.close, "quoted": json.dumps(old, ensure_ascii=False)}
                yield pointed, message, text[:begin] + added.get(new, new) + text[end:]


def _find(pattern: str, text: str, span: _Span, order: str, at: int) -> list[re.Match[str]]:
    """Return matches of a mistake: only ``here``, with those ``near`` the stop first, or all."""
    matches = [*re.compile(pattern, re.MULTILINE).finditer(text, span.begin, span.end)]
    if order == "near":
        matches.sort(key=lambda match: abs(match.start("old") - at))
    return [match for match in matches if order != "here" or match.start() == span.begin]


def _word(text: str, index: int) -> str:
    return re.split(r"[\s:,\]}]", text[index : index + 40])[0] or text[index : index + 1]


def _indents(text: str, at: int) -> Iterator[Mend]:
    """Yield changes that give a line, or the previous one, the indent of a neighbouring line."""
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
                message = f"a hyphen is missing: begin with {quote(lead)}, as line {number} does"
            else:
                blanks = "1 blank" if indent == 1 else f"{indent} blanks"
                message = f"begins with {blanks}: {len(lead)} are needed, as on line {number}"
            yield start + indent, message, text[:start] + lead + text[start + indent :]


def _lead(text: str, start: int) -> str:
    """Return the indent of a line, with the hyphen of a list item."""
    lead = re.compile(r" *(?:- )?").match(text, start)
    return lead.group() if lead else ""


def _line_start(text: str, index: int) -> int:
    return text.rfind("\n", 0, index) + 1


def _line_end(text: str, index: int) -> int:
    end = text.find("\n", index)
    return len(text) if end < 0 else end


def _visible(text: str, index: int) -> int:
    """Return the index, or that of the last visible character at the end of a text."""
    return index if text[index:].strip() else max(len(text.rstrip()) - 1, 0)
