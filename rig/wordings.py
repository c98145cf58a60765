"""The one table of what the program says of each code: its kind, label, sentence and remedy.

The rows are in ``wordings.txt``. `rig.reasons` fills in values and the words of a scene; sentences
are written there, never read back.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from string import Template

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


@dataclass(frozen=True, slots=True)
class Wording:
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
    remedy: str = ""
    label: str = ""
    error: type[RigError] = RigError


def _read_rows() -> tuple[dict[str, Wording], dict[str, str]]:
    """Return the rows of the table by their codes, and the texts that several share."""
    rows: dict[str, Wording] = {}
    shared: dict[str, str] = {}
    for head, *lines in read_paragraphs(__file__):
        if head == "shared":
            shared = dict(line.strip().split(": ", 1) for line in lines)
            continue
        name, _, label = head.partition(": ")
        kind, code = name.split()
        error = vars(errors).get(kind)
        severity = Severity[kind.upper()] if error is None else Severity.VOID
        sentence, *remedy = (Template(line.strip()).safe_substitute(shared) for line in lines)
        rows[code] = Wording(severity, sentence, "".join(remedy), label, error or RigError)
    return rows, shared


WORDINGS, _SHARED = _read_rows()
"""What the program says of each code, and what several of them say."""
LOOK = _SHARED["look"]
