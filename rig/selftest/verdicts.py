"""How a check can end."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """The three ends of a check, in the words that are shown."""

    OK = "ok"
    FAILED = "failed"
    NOT_POSSIBLE = "not possible here"


@dataclass(frozen=True, slots=True)
class CheckResult:
    """How one check ended, and what there is to say about it (may be empty)."""

    name: str
    verdict: Verdict
    why: str = ""

    def __str__(self) -> str:
        if self.verdict is Verdict.OK:
            return f"{self.name}: ok" + (f" ({self.why})" if self.why else "")
        return f"{self.name}: {self.verdict}: {self.why}"


class CheckFailedError(Exception):
    """The board did not do what it must."""


class NotPossibleError(Exception):
    """The check needs something that is not here."""
