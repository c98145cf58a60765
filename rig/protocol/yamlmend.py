"""What a text that is no YAML lacks: a quote, a bracket, a colon, a comma, an indent.

The parser says where it stopped, in the words of its grammar. What people need is the smallest
change that lets it go on; so changes are tried around the place, and the parser itself judges them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import yaml

from rig.units import quoted

MOST_PARSED = 150_000
"""Characters parsed in search of a change: about a second, and fifty changes of a page."""
_PAIRS = {"[": "]", "{": "}"}
_MARKS = "[]{},:-\"'"
_BRACKET_OR_QUOTED = re.compile(r"\"[^\"]*(?:\"|$)|'[^']*(?:'|$)|[\[\]{}]")
_QUOTE = re.compile(r"\"[^\"\n]*\"|'[^'\n]*'|(?<![^\s\[{,:])(?P<open>[\"'])[^\n]*")
_VALUE = re.compile(r"(?<=: )(?=\S)[^\n]*?(?=\s*(?:[#\n]|$))")
_MISSING = (
    (re.compile(r" *-"), " ", "a blank is missing after the hyphen"),
    (
        re.compile(r"\s*(?:- )?([\w.]++):(?=[^\s#])"),
        " ",
        "a blank is missing after the colon of {}",
    ),
    (re.compile(r"\s*(?:- )?([\w.]++)(?! *:)"), ": ", "a colon is missing after {}"),
)
"""What a line may begin with, what is then inserted behind it, and a sentence."""
NOT_READABLE = "this line cannot be read from here on: see its quotes, brackets, colons and indent"


class Mend(NamedTuple):
    """One change of a text: what is at `begin` to `end` becomes `new`; `place` is its index."""

    place: int
    message: str
    begin: int
    end: int
    new: str

    def apply(self, text: str) -> str:
        """Return the changed text."""
        return text[: self.begin] + self.new + text[self.end :]


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
    farther: Mend | None = None
    for mend in islice(_mends(text, stop, begin), MOST_PARSED // (len(text) + 1)):
        reach = _reach(mend.apply(text))
        if reach is None:
            return mend.place, mend.message
        if farther is None and reach > _line_end(text, stop):
            farther = mend
    return (farther.place, farther.message) if farther else (_visible(text, stop), NOT_READABLE)


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


def _mends(text: str, stop: int, begin: int) -> Iterator[Mend]:
    """List changes that could let the parser go on, the likeliest first.

    `stop` is where it stopped, `begin` where that began which it could not finish.
    """
    at = _visible(text, stop)
    character = text[at : at + 1]
    if character == "\t":
        yield Mend(at, "a tab; use blanks", at, at + 1, " ")
    yield from _open_quotes(text, stop)
    for start in dict.fromkeys((_line_start(text, begin), _line_start(text, at))):
        yield from _colons(text, start)
    yield from _brackets(text, at, begin)
    yield from _quotable(text, at)
    yield from _indents(text, at)
    yield from _stray(text, at, begin)


def _stray(text: str, at: int, begin: int) -> Iterator[Mend]:
    """Leave out a character, or a word behind a value."""
    before = _line_start(text, max(_line_start(text, begin) - 1, 0))
    marks = [n for n in range(before, _line_end(text, at)) if text[n] in _MARKS]
    for n in sorted({*marks, at}, key=lambda n: (text[n : n + 1] not in _MARKS, abs(n - at))):
        if text[n : n + 1].strip():
            yield Mend(n, f"unexpected {quoted(text[n])}: leave it out", n, n + 1, "")
    word = re.compile(r"[^\s,\]}]+").match(text, at)
    if word is not None:
        message = f"unexpected {quoted(word.group())} after a value: leave it out"
        yield Mend(at, message, at, word.end(), "")


def _open_quotes(text: str, stop: int) -> Iterator[Mend]:
    """Close a quote at the end of its line, before a comma, bracket or comment if there is one."""
    for quote in _QUOTE.finditer(text, 0, stop):
        start, mark = quote.start(), quote["open"]
        if mark is None:
            continue
        message = f"a quote is open from here: close it with {mark}"
        for end in re.finditer(r"\s*(?:#|[,}\]]|$)", text[start + 1 : _line_end(text, start)]):
            to = start + 1 + end.start()
            yield Mend(start, message, to, to, mark)
        yield Mend(start, f"{message}, or leave it out", start, start + 1, "")


def _colons(text: str, start: int) -> Iterator[Mend]:
    """Give the first word of a line a colon, and a blank behind it; likewise the line before."""
    before = _line_start(text, max(start - 1, 0))
    for line in dict.fromkeys((start, before)):
        for pattern, new, message in _MISSING:
            if match := pattern.match(text, line):
                end, word = match.end(), quoted(match[match.lastindex or 0])
                yield Mend(end, message.format(word), end, end, new)


def _brackets(text: str, at: int, begin: int) -> Iterator[Mend]:
    """Close or open a bracket, or put a comma between two values."""
    opened: list[int] = []
    for mark in _BRACKET_OR_QUOTED.finditer(text, _line_start(text, begin), at):
        if mark.group() in _PAIRS:
            opened.append(mark.start())
        elif mark.group() in _PAIRS.values() and opened:
            opened.pop()
    character = text[at : at + 1]
    if text[begin : begin + 1] in _PAIRS and begin not in opened:
        opened.insert(0, begin)
    if opened:
        last = opened[-1]
        bracket, end = _PAIRS[text[last]], _line_end(text, last)
        gaps = re.compile(r"(?<=[^\s,:{\[])\s+(?=[\w{\[\"'])").finditer(text, last, at + 1)
        for gap in reversed([*gaps]):
            message = f"a comma is missing before {quoted(_word(text, gap.end()))}"
            yield Mend(gap.end(), message, gap.start(), gap.start(), ",")
        message = f"{text[last]} is open from here: close it with {bracket}"
        comment = re.compile(r"\s+#").search(text, last, end)
        places = [at] if character in {"]", "}"} else []
        for to in (*places, comment.start() if comment else len(text[:end].rstrip())):
            yield Mend(last, message, to, to, bracket)
        if character in {"]", "}"}:
            message = f"{quoted(character)} does not close {text[last]}: write {bracket}"
            yield Mend(at, message, at, at + 1, bracket)
    start = _line_start(text, at)
    for bracket, closing in _PAIRS.items():
        starts = re.compile(r"(?:- |: +)(?=[^\s{\[])").finditer(text, start, _line_end(text, at))
        for value in sorted((match.end() for match in starts), key=lambda n: abs(n - at)):
            message = f"{bracket} is missing before {quoted(_word(text, value))}"
            if closing in text[value : _line_end(text, at)]:
                yield Mend(value, message, value, value, bracket)


def _word(text: str, index: int) -> str:
    return re.split(r"[\s:,\]}]", text[index : index + 40])[0] or text[index : index + 1]


def _quotable(text: str, at: int) -> Iterator[Mend]:
    """Put the value of a line in quotes; double a backslash."""
    start, end = _line_start(text, at), _line_end(text, at)
    if (slash := text.rfind("\\", start, at + 1)) >= 0:
        message = r"\ with this letter behind it means nothing: write \\, or use ' for quotes"
        yield Mend(slash, message, slash, slash, "\\")
    value = _VALUE.search(text, start, end)
    if value is not None and value.group()[0] not in "[{\"'":
        quoted_value = '"' + value.group().replace("\\", "\\\\").replace('"', '\\"') + '"'
        message = f"{quoted(text[at])} is not accepted here: put this value in quotes"
        yield Mend(at, message, *value.span(), quoted_value)


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
            yield Mend(start + indent, message, start, start + indent, lead)


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
