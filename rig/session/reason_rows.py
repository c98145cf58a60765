"""Reasons as the session file has them: records with codes, and sentences alone in old files."""

from __future__ import annotations

import json
from collections.abc import Iterable

from rig.reasons import Reason, make_reason, plain_reason, read_record
from rig.wordings import NOTE

_OLD_NOTE = "note: "


def write_reasons(reasons: Iterable[Reason]) -> str:
    """Write reasons as a row has them."""
    return json.dumps([reason.record() for reason in reasons], ensure_ascii=False)


def read_reasons(text: str) -> tuple[Reason, ...]:
    """Read what `write_reasons` wrote, or the list of sentences of an old file.

    Raises
    ------
    TypeError, ValueError
        It is something else.
    """
    rows = json.loads(text)
    if not isinstance(rows, list):
        raise TypeError(f"{text:.40} is no list of reasons")
    return tuple(_read_sentence(row) if isinstance(row, str) else read_record(row) for row in rows)


def _read_sentence(text: str) -> Reason:
    if text.startswith(_OLD_NOTE):
        return make_reason(NOTE, text=text.removeprefix(_OLD_NOTE))
    return plain_reason(text)
