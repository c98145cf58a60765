"""One error root, each error with a hint for the user and an exit code for scripts."""

from collections.abc import Iterable
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


class RigError(Exception):
    """Any failure the user can act on.

    Parameters
    ----------
    message
        What happened, in one sentence.
    hint
        What to do next; empty when the message already says it.

    Attributes
    ----------
    reasons
        The `rig.reasons.Reason` of it, where it has a code: see `rig.reasons.rig_error`.
    """

    exit_code = 1
    reasons: tuple[Any, ...] = ()

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\n  hint: {self.hint}" if self.hint else self.message

    @property
    def two_lines(self) -> str:
        """Its message and its hint, a line each, as screens take them apart."""
        return f"{self.message}\n{self.hint}"


class InputError(RigError):
    """Bad input: one located line a problem, or one reason for all of it; exit code 2."""

    exit_code = 2

    def __init__(self, message: str = "", hint: str = "", *, problems: Iterable[Problem] = ()):
        self.problems = tuple(sorted(problems, key=lambda problem: problem[:-1]))
        super().__init__(message or "\n".join(map(str, self.problems)), hint)


class DomainError(InputError, ValueError):
    """A model was asked for a value it cannot give (for example a singular Eq. 13)."""


class DeviceError(RigError):
    """The device refused, broke off or answered nonsense, exit code 4."""

    exit_code = 4


class DeviceTimeoutError(DeviceError, TimeoutError):
    """The device did not answer in time."""


class StoppedError(DeviceError):
    """A client pressed STOP, or the one in control was lost."""


class ControlError(DeviceError):
    """Another client holds what this one asked for."""


class BusyError(DeviceError):
    """So many clients are there, or so many requests wait, that no more is taken."""


class VersionError(RigError):
    """Client and daemon do not speak the same interface."""

    exit_code = 4


class ClusterError(RigError):
    """A cluster cannot be reached, is not fit or breaks off, exit code 4."""

    exit_code = 4


class SessionError(RigError, OSError):
    """The session file cannot be used as asked."""

    exit_code = 2
