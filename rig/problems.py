"""Faults of input files at their places, as `rig.errors.InputError` lists them."""

from __future__ import annotations

from typing import Any, NamedTuple


class Problem(NamedTuple):
    """One fault of an input file, at its place (lines and columns count from 1).

    `excerpt` is what a message shows below: the line itself and a caret, or nothing. `reason` is
    the `rig.reasons.Reason` of the message, where it has one.
    """

    file: str
    line: int
    column: int
    key: str
    message: str
    excerpt: str = ""
    reason: Any = None

    def __str__(self) -> str:
        key = f" {self.key}:" if self.key else ""
        return f"{self.file}:{self.line}:{self.column}:{key} {self.message}{self.excerpt}"
