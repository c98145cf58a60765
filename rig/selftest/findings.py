"""How a check of the self-test or the doctor can end."""

import re
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

from rig.errors import DeviceError, RigError, SessionError
from rig.reasons import Reason, error_of, make_reason, remedies, rig_error

_ENUM = re.compile(r"<(?:\w+\.)?([\w|]+): \w+>")  # as Python writes a member of an enumeration


class Verdict(StrEnum):
    """The three ends of a check, in the words that are shown."""

    OK = "ok"
    FAILED = "failed"
    NOT_POSSIBLE = "not possible here"


class Finding(NamedTuple):
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
    def failed(self) -> bool:
        """Whether something is wrong."""
        return self.verdict is Verdict.FAILED

    def json(self) -> dict[str, object]:
        """Return it as JSON has it."""
        verdict, codes = self.verdict.name.lower(), [self.reason.json()] if self.reason else []
        words = {"name": self.name, "verdict": verdict, "what": self.what, "advice": self.advice}
        return {**words, "reason_codes": codes}

    def __str__(self) -> str:
        line = ": ".join(filter(None, (self.name, self.verdict, self.what)))
        return line + (f"\n  do: {self.advice}" if self.advice else "")


class NotPossibleError(DeviceError):
    """A check needs something that is not here."""


def make_check(name: str, check: Callable[..., str | None], *facts: object) -> Finding:
    """Make a check; give what it returned, in words, or the reason for which it ended."""
    try:
        return Finding(name, check(*facts) or "")
    except NotPossibleError as error:
        return explain(name, error, Verdict.NOT_POSSIBLE)
    except (DeviceError, SessionError) as error:
        return explain(name, error)


def explain(name: str, error: RigError, verdict: Verdict = Verdict.FAILED) -> Finding:
    """Return what a check found where all is not well."""
    reason = next(iter(error.reasons), make_reason("failed", text=error.message, hint=error.hint))
    return Finding(name, reason.text, verdict, reason)


def wrong_answer(request: str, expected: object, answer: object) -> RigError:
    """Return the failure of a board that gave another answer than expected."""
    expected, answer = (_ENUM.sub(r"\1", str(value)) for value in (expected, answer))
    return rig_error("wrong_answer", request=request, expected=expected, answer=answer)


def fail_if(broken: object, code: str, **values: object) -> None:
    """Let a check fail for a reason if that is so."""
    if broken:
        raise error_of(DeviceError, make_reason(code, **values))


def need(present: object, needed: str) -> None:
    """Let a check be impossible, by saying what it needs, unless that is there."""
    if not present:
        raise error_of(NotPossibleError, make_reason("check_needs", needed=needed))


def insist(request: str, answer: object, expected: object) -> None:
    """Let a check fail unless a request had the expected answer."""
    if answer != expected:
        raise wrong_answer(request, expected, answer)
