"""How a check of the self-test or the doctor can end."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from rig.reasons import Reason, make_reason, remedies

_ENUM = re.compile(r"<(?:\w+\.)?([\w|]+): \w+>")  # as Python writes a member of an enumeration


class Verdict(StrEnum):
    """The three ends of a check, in the words that are shown."""

    OK = "ok"
    FAILED = "failed"
    NOT_POSSIBLE = "not possible here"


@dataclass(frozen=True, slots=True)
class Finding:
    """What a check found, in words, and where all is not well the reason."""

    name: str
    what: str = ""
    verdict: Verdict = Verdict.OK
    reason: Reason | None = None

    @property
    def advice(self) -> str:
        """What to do about it; empty where all is well."""
        return "; ".join(remedies([self.reason])) if self.reason else ""

    @property
    def line(self) -> str:
        """Name, verdict and words in one line."""
        return ": ".join(filter(None, (self.name, self.verdict, self.what)))

    def json(self) -> dict[str, object]:
        """Return it as JSON has it."""
        verdict, codes = self.verdict.name.lower(), [self.reason.json()] if self.reason else []
        words = {"name": self.name, "verdict": verdict, "what": self.what, "advice": self.advice}
        return {**words, "reason_codes": codes}

    def __str__(self) -> str:
        return f"{self.name}: {self.what}" + (f"\n  do: {self.advice}" if self.advice else "")


def explain(name: str, reason: Reason, verdict: Verdict = Verdict.FAILED) -> Finding:
    """Return what a check found where all is not well."""
    return Finding(name, reason.text, verdict, reason)


class CheckEndedError(Exception):
    """A check ended with a reason, a code of `rig.wordings` with its values."""

    verdict = Verdict.FAILED

    def __init__(self, code: str, **values: object) -> None:
        self.reason = make_reason(code, **values)
        super().__init__(self.reason.text)


class CheckFailedError(CheckEndedError):
    """The board did not do what it must."""


class NotPossibleError(CheckEndedError):
    """The check needs something that is not here."""

    verdict = Verdict.NOT_POSSIBLE


def make_check(name: str, check: Callable[..., str | None], *facts: object) -> Finding:
    """Make a check; give what it returned, in words, or the reason for which it ended."""
    try:
        return Finding(name, check(*facts) or "")
    except CheckEndedError as end:
        return explain(name, end.reason, end.verdict)


def wrong_answer(request: str, expected: object, answer: object) -> CheckFailedError:
    """Return the failure of a board that gave another answer than expected."""
    expected, answer = (_ENUM.sub(r"\1", str(value)) for value in (expected, answer))
    return CheckFailedError("wrong_answer", request=request, expected=expected, answer=answer)


def fail_if(broken: object, code: str, **values: object) -> None:
    """Let a check fail for a reason if that is so."""
    if broken:
        raise CheckFailedError(code, **values)


def need(present: object, needed: str) -> None:
    """Let a check be impossible, by saying what it needs, unless that is there."""
    if not present:
        raise NotPossibleError("check_needs", needed=needed)


def insist(request: str, answer: object, expected: object) -> None:
    """Let a check fail unless a request had the expected answer."""
    if answer != expected:
        raise wrong_answer(request, expected, answer)
