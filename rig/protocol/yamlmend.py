"""Suggested corrections of invalid YAML: a quote, a bracket, a colon, a comma, an indent.

The parser reports where it stopped, in terms of its grammar. Users need the smallest change with
which it continues. So the mistakes of ``yamlmend.txt`` are searched for around that place, and each
change is tested by the parser.
"""

import json
import re
from collections.abc import Iterator
from itertools import chain, islice

import yaml

from rig.text_rows import read_paragraphs
from rig.units import quote

MOST_PARSED = 150_000
"""Most characters parsed in a search: about a second, or fifty changes of a page."""
_NEAREST = 6
"""Most matches of a mistake that are tried: with 4 to 10, 2 of 460 damaged files differ."""
_QUOTES = {'"': '"', "'": "'"}
_BRACKETS = {"[": "]", "{": "}"}
_CLOSING = _QUOTES | _BRACKETS
_QUOTE_OR_BRACKET = re.compile(
    r"\"[^\"\n]*\"|'[^'\n]*'|(?<![^\s\[{,:])(?P<open>[\"'])[^\n]*|[\[\]{}]"
)
NOT_READABLE = "this line cannot be read from here on: see its quotes, brackets, colons and indent"
_MISTAKES, _SURPLUS, _REFUSED = read_paragraphs(__file__)
_COMPOSED = dict(re.split(r" +\| ", row) for row in _REFUSED)
"""What PyYAML's composer refuses, and in which words."""
_INDENT = re.compile(r"^( *)((?:- )?)(?![ #\n])", re.MULTILINE)
_NEW = {"nothing": "", "blank": " ", "colon": ": "}
Mend = tuple[int, str, str]
"""A place in a text, what is wrong there, and the text as it should be."""


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
    # At the end of a text that of its last visible character.
    at = stop if text[stop:].strip() else max(len(text.rstrip()) - 1, 0)
    farther = None
    mends = chain(
        _list_mends(text, at, begin, _MISTAKES),
        _list_indents(text, at),
        _list_mends(text, at, begin, _SURPLUS),
    )
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


def _list_spans(text: str, at: int, begin: int) -> dict[str, list[tuple[int, int]]]:
    """Return the begins and ends of each place of the table.

    Parameters
    ----------
    at
        Index of the visible character at which the parser stopped.
    begin
        Index of the construct that it could not finish.
    """
    quotes, brackets = {begin}, [begin]
    for mark in _QUOTE_OR_BRACKET.finditer(text, 0, at):
        if mark["open"]:
            quotes.add(mark.start())
        elif mark.group() in _BRACKETS:
            brackets.append(mark.start())
        elif mark.group() in _BRACKETS.values():
            brackets = brackets[:-1]
    opened = [n for n in brackets if text[n : n + 1] in _BRACKETS][-1:]
    before = _line_start(text, max(_line_start(text, begin) - 1, 0))
    return {
        "line": [(_line_start(text, at), _line_end(text, at))],
        "around": [(before, _line_end(text, at))],
        "quote": [(n, _line_end(text, n)) for n in sorted(quotes) if text[n : n + 1] in _QUOTES],
        "bracket": [(n, max(at + 1, _line_end(text, n))) for n in opened],
    }


def _list_mends(text: str, at: int, begin: int, table: list[str]) -> Iterator[Mend]:
    """Yield changes of a table with which the parser might continue, the likeliest first."""
    spans = _list_spans(text, at, begin)
    for where, pattern, new, sentence in (re.split(r" +\| ", row, maxsplit=3) for row in table):
        for opening, end in spans[where]:
            opened, close = text[opening], _CLOSING.get(text[opening], "")
            matches = re.compile(pattern, re.MULTILINE).finditer(text, opening, end)
            for match in sorted(matches, key=lambda match: abs(match.start("old") - at))[:_NEAREST]:
                first, last = match.span("old")
                words = {name: quote(part) for name, part in match.groupdict().items()}
                message = sentence.format(**words, opened=opened, close=close)
                added = {"close": close, "quoted": json.dumps(match["old"]), **_NEW}
                mended = text[:first] + added.get(new, new) + text[last:]
                yield (match.start("at") if "at" in words else opening), message, mended


def _list_indents(text: str, at: int) -> Iterator[Mend]:
    """Yield changes that give a line, or the previous one, the indent of a line above."""
    lines = [*_INDENT.finditer(text, 0, _line_end(text, at))]
    for line in lines[-2:]:
        leads = {other.groups(): text.count("\n", 0, other.start()) + 1 for other in lines}
        begin, own_hyphen = line.groups()
        for (blanks, hyphen), number in reversed(leads.items()):
            if hyphen > own_hyphen:
                lead = quote(blanks + hyphen)
                message = f"a hyphen is missing: begin with {lead}, as line {number} does"
            else:
                found = f"{len(begin)} blank{'s' * (len(begin) != 1)}"
                message = f"begins with {found}: {len(blanks)} are needed, as on line {number}"
            mended = text[: line.start()] + blanks + (hyphen or own_hyphen) + text[line.end() :]
            yield line.end(1), message, mended


def _line_start(text: str, index: int) -> int:
    return text.rfind("\n", 0, index) + 1


def _line_end(text: str, index: int) -> int:
    end = text.find("\n", index)
    return len(text) if end < 0 else end
