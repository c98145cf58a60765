"""Text from outside (ports, titles, notes, errors) made safe for one line of a terminal."""

from __future__ import annotations

import unicodedata

LONGEST = 400
"""Characters of one text from outside that are shown; nobody reads more on a screen."""
_HIDDEN = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
"""Categories that print nothing, or change what is printed around them."""


def plain(text: object, limit: int = LONGEST) -> str:
    """Make text harmless: one line, no control or direction characters, not endless.

    Parameters
    ----------
    text
        Anything; what it prints as is taken.
    limit
        Longest result; longer texts end in ``…``.
    """
    raw = str(text)
    # Cut first: a megabyte of note costs no more than what is shown of it.
    cut = raw[: limit + 1]
    shown = "".join(_shown(character) for character in cut)
    return shown if len(raw) <= limit else shown[: limit - 1] + "…"


def _shown(character: str) -> str:
    if character in "\n\r\t":
        return " "
    if unicodedata.category(character) in _HIDDEN:
        return "\N{REPLACEMENT CHARACTER}"
    return character


def duration(seconds: float) -> str:
    """Write how long something takes, as people say it."""
    minutes, rest = divmod(round(seconds), 60)
    if not minutes:
        return f"{rest} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s"
