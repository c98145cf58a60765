"""Text from outside, made safe for a log, a terminal and a file."""

import unicodedata

_HIDDEN = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
"""Categories that print nothing, or change what is printed around them."""


def is_hidden(character: str) -> bool:
    """Whether a character prints nothing, or changes what is printed around it."""
    return unicodedata.category(character) in _HIDDEN


def printable(text: str) -> str:
    r"""Write what does not print as an escape, such as ``\x1b`` or ``\u202e``; lines stay lines.

    Bytes of a file's name that are not UTF-8 are half of a surrogate pair here, and print as
    ``\udcff``.
    """
    return "".join(
        character.encode("unicode_escape").decode("ascii")
        if is_hidden(character) and character not in "\n\t"
        else character
        for character in text
    )


def one_line(text: str, limit: int) -> str:
    """Cut text to so many characters on one line, those that do not print replaced."""
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if is_hidden(character) else character
        for character in text[:limit]
    )


def encodable(text: str) -> str:
    """Replace what UTF-8 cannot hold: half a surrogate pair, as in names that are not UTF-8."""
    return text.encode("utf-8", "replace").decode("utf-8")
