"""The one table of what the program says of each code: its kind, label, sentence and remedy.

The rows are in ``wordings.txt``. `rig.reasons` fills in values and the words of a scene; sentences
are written there, never read back.
"""

from enum import IntEnum
from string import Template
from typing import NamedTuple

from rig import errors
from rig.errors import RigError
from rig.text_rows import read_paragraphs

OPERATOR, NOTE, SENTENCE = "operator", "note", "sentence"
"""Codes of what is only text: a cause to reject a drop, a note to it, a sentence of an old file."""


class Severity(IntEnum):
    """What a reason does to a verdict."""

    REMARK = 0
    DOUBT = 1
    VOID = 2


class Wording(NamedTuple):
    """What the program says of one code.

    Attributes
    ----------
    severity
        What it does to a verdict.
    sentence
        With places for values, see `rig.reasons`.
    remedy
        What to do about it; empty where nothing is to be done.
    label
        In a few words, where several drops have it; empty where the code says it.
    error
        What a request ends with that is refused for it.
    """

    severity: Severity
    sentence: str
    remedy: str
    label: str
    error: type[RigError]


(_, *_TEXTS), *_PARAGRAPHS = read_paragraphs(__file__)
_SHARED = dict(line.strip().split(": ", 1) for line in _TEXTS)
"""What several sentences say, by name."""
LOOK = _SHARED["look"]


def _wording(head: str, *lines: str) -> tuple[str, Wording]:
    """Read a paragraph of the table: a code, and what the program says of it."""
    name, _, label = head.partition(": ")
    kind, code = name.split()
    error = vars(errors).get(kind)
    severity = Severity[kind.upper()] if error is None else Severity.VOID
    sentence, *remedy = (Template(line.strip()).safe_substitute(_SHARED) for line in lines)
    return code, Wording(severity, sentence, "".join(remedy), label, error or RigError)


WORDINGS = dict(_wording(*paragraph) for paragraph in _PARAGRAPHS)
