"""Stages of a campaign, the events that may happen in them, and the effects they may want."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from rig.link.refusals import DeviceRefusedError

if TYPE_CHECKING:
    from rig.campaign.voids import VoidRow
    from rig.errors import RigError
    from rig.link.messages import RefusalReason
    from rig.reasons import Reason
    from rig.records import Job


class Stage(StrEnum):
    """Where the campaign is."""

    PROTOCOL = "protocol"
    DEVICE = "device"
    TESTING = "testing"
    PREPARE = "prepare"
    SETTLING = "settling"
    ARMING = "arming"
    COUNTDOWN = "countdown"
    FIRING = "firing"
    LIVE = "live"
    JUDGING = "judging"
    RESULT = "result"
    HALTED = "halted"
    DONE = "done"


# ---------------------------------------------------------------- events


class Opened(NamedTuple):
    """A session is open at the daemon."""


class Closed(NamedTuple):
    """The session was closed."""


class GoOn(NamedTuple):
    """The operator wants the next step; `job` is the attempt it would be at."""

    job: Job | None
    settle_s: float = 0.0


class Try(NamedTuple):
    """The operator wants the release driven once, with nothing hung."""


class Answered(NamedTuple):
    """An effect was carried out; `token` is of an `Arm`."""

    ticket: int
    token: int | None = None


class Judged(NamedTuple):
    """The drop was analysed.

    Attributes
    ----------
    row
        Voids in a row before it by the session's log, to which others may have added; `None` for
        those that were counted here.
    """

    ticket: int
    verdict: str
    reasons: tuple[Reason, ...]
    row: VoidRow | None = None


class EffectFailed(NamedTuple):
    """An effect failed; see `effect_failed`.

    Attributes
    ----------
    trouble
        Why, and on a second line what to do.
    reason, detail
        The device's own, where it is the device that refused.
    """

    ticket: int
    trouble: str
    reason: RefusalReason | None = None
    detail: int = 0


def effect_failed(ticket: int, error: RigError) -> EffectFailed:
    """Make the event of an error."""
    trouble = f"{error.message}\n{error.hint}"
    if isinstance(error, DeviceRefusedError):
        return EffectFailed(ticket, trouble, error.reason, error.detail)
    return EffectFailed(ticket, trouble)


class Tick(NamedTuple):
    """Time went by."""

    seconds: float


class Stopped(NamedTuple):
    """STOP, or any key before the release."""


class Lost(NamedTuple):
    """The daemon is out of reach, or control is somebody else's."""

    trouble: str


class Warned(NamedTuple):
    """Something went wrong that changes nothing here."""

    trouble: str


class Found(NamedTuple):
    """The session has a recorded drop that nobody has judged."""

    job: Job


class Reject(NamedTuple):
    """The operator rejects the drop."""

    cause: str


class Restore(NamedTuple):
    """The operator takes the rejection back."""


class Note(NamedTuple):
    """The operator has something to say about the drop."""

    text: str


class Again(NamedTuple):
    """The operator wants another attempt."""

    job: Job


Event: TypeAlias = (
    Opened | Closed | GoOn | Try | Answered | Judged | EffectFailed | Tick | Stopped | Lost | Warned
    | Found
    | Reject | Restore | Note | Again
)  # fmt: skip

# ---------------------------------------------------------------- effects


class Wait(NamedTuple):
    """Let the chains come to rest."""

    seconds: float


class ArmRelease(NamedTuple):
    """Prepare the release."""

    job: Job


class FireRelease(NamedTuple):
    """Let go."""

    token: int


class Drive(NamedTuple):
    """Let go of nothing: a test."""


class Collect(NamedTuple):
    """Wait until the drop is in the session file."""

    job: Job


class Judge(NamedTuple):
    """Analyse the drop."""

    job: Job


class Log(NamedTuple):
    """Put a verdict into the session file."""

    job: Job
    state: str
    reasons: tuple[Reason, ...]


class Stop(NamedTuple):
    """Everything off."""

    reason: str = "stopped by the operator"


class GiveUp(NamedTuple):
    """Go no further by yourself: only who drives this can say what is to be done."""


Effect: TypeAlias = Wait | ArmRelease | FireRelease | Drive | Collect | Judge | Log | Stop | GiveUp
