"""A plan on its way as a pure machine: event in, new stage and effects out.

Nothing here knows of screens, sockets or clocks. Whoever drives it carries the effects out and
returns what came of them, with the ticket of the effect: an answer to what was stopped meanwhile
has an old ticket and changes nothing. Stages, events and effects come first, then the steps.
"""

from enum import StrEnum
from typing import NamedTuple, TypeAlias

from rig.campaign.voids import VoidRow, after, why_halted
from rig.errors import RigError
from rig.link.messages import RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.reasons import NOTE, OPERATOR, Reason, plain_reason
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


class SessionOpen(NamedTuple):
    """A session is open at the daemon."""


class SessionClose(NamedTuple):
    """The session was closed."""


class GoOn(NamedTuple):
    """The operator wants the next step; `job` is the attempt it would be at."""

    job: Job | None
    settle_s: float = 0.0


class Try(NamedTuple):
    """The operator wants the release driven once, with nothing hung."""


class EffectDone(NamedTuple):
    """An effect was carried out; `token` is of an `Arm`."""

    ticket: int
    token: int | None = None


class DropVerdict(NamedTuple):
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


class EffectFailure(NamedTuple):
    """An effect failed; see `effect_failure`.

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


def effect_failure(ticket: int, error: RigError) -> EffectFailure:
    """Make the event of an error."""
    own = (error.reason, error.detail) if isinstance(error, DeviceRefusedError) else ()
    return EffectFailure(ticket, error.two_lines, *own)


class Tick(NamedTuple):
    """Time went by."""

    seconds: float


class StopRequest(NamedTuple):
    """STOP, or any key before the release."""


class Lost(NamedTuple):
    """The daemon is out of reach, or control is somebody else's."""

    trouble: str


class Notice(NamedTuple):
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


_Wish: TypeAlias = GoOn | Try | StopRequest | Reject | Restore | Note | Again
_News: TypeAlias = EffectDone | DropVerdict | EffectFailure | Tick | Lost | Notice | Found
Event: TypeAlias = SessionOpen | SessionClose | _Wish | _News

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

# ---------------------------------------------------------------- steps

COUNTDOWN_S = 3.0
"""From armed to fired: time to take a hand away, or to press a key."""
LOOKS = 5
"""How often what a device refuses is tried when nobody is there to help."""
LOOK_S = 1.0

BEFORE_RELEASE = (Stage.TESTING, Stage.SETTLING, Stage.ARMING, Stage.COUNTDOWN, Stage.FIRING)
"""Stages that any key ends."""
_IDLE = (Stage.DEVICE, Stage.PREPARE, Stage.DONE)
_VERDICT = (Stage.RESULT, Stage.HALTED)
_PASSING = (RefusalReason.COOLING, RefusalReason.GATE_BLOCKED, RefusalReason.STOPPED)
"""Refusals to arm that end by themselves, or that somebody at the rig can end."""
_DISTURBED = (
    RefusalReason.GATE_BLOCKED,
    RefusalReason.GATE_UNSTEADY,
    RefusalReason.NOT_ARMED,
    RefusalReason.STOPPED,
)
"""Refusals to fire after which the drop can be prepared again."""

Outcome: TypeAlias = "tuple[Flow, tuple[Effect, ...]]"


class Flow(NamedTuple):
    """Where the campaign is.

    Attributes
    ----------
    job
        The attempt in hand, or last in hand.
    ticket
        Of the effect that is being waited for.
    token
        What the device wants to hear with `Fire`.
    countdown_s, left_s
        The countdown, and what is left of it.
    logged
        Whether the verdict is in the session file.
    verdict, reasons
        Of this drop, as logged.
    judged
        The verdict and reasons of the analysis.
    rejection, note
        What the operator has to say against the drop, and about it; each a reason or none.
    trouble
        What went wrong last; empty when it is over.
    home
        Where a stage leads that ends without a drop.
    refusals
        How often the device has refused to arm or to fire, since it fired last.
    row
        Voids in a row.
    attended
        Whether somebody is there, who then begins every arming. Else what a device refuses is
        tried again, at most `LOOKS` times.
    """

    stage: Stage = Stage.PROTOCOL
    job: Job | None = None
    ticket: int = 0
    token: int = 0
    countdown_s: float = COUNTDOWN_S
    left_s: float = 0.0
    logged: bool = True
    verdict: str = ""
    reasons: tuple[Reason, ...] = ()
    judged: tuple[str, tuple[Reason, ...]] = ("", ())
    rejection: tuple[Reason, ...] = ()
    note: tuple[Reason, ...] = ()
    trouble: str = ""
    home: Stage = Stage.PREPARE
    refusals: int = 0
    attended: bool = True
    row: VoidRow = ()

    def to(self, stage: Stage, trouble: str = "") -> "Flow":
        """Go to another stage; answers to earlier effects count no more."""
        ticket = self.ticket + 1
        return self._replace(stage=stage, ticket=ticket, trouble=trouble, home=Stage.PREPARE)


def step(flow: Flow, event: Event) -> Outcome:  # noqa: PLR0912 - one line an event
    """Take one event."""
    match event:
        case StopRequest():
            return _stop(flow)
        case Lost(trouble):
            return _lost(flow, trouble)
        case Notice(trouble):
            return flow._replace(trouble=flow.trouble or trouble), ()
        case EffectDone(flow.ticket, token):
            return _take_answer(flow, token)
        case EffectDone(token=int()):
            # What was stopped while the device was arming must not stay armed.
            return flow, (Stop(),)
        case EffectFailure(flow.ticket):
            return _effect_failed(flow, event)
        case Tick(seconds) if flow.stage is Stage.COUNTDOWN:
            if seconds < flow.left_s:
                return flow._replace(left_s=flow.left_s - seconds), ()
            return flow.to(Stage.FIRING)._replace(left_s=0.0), (FireRelease(flow.token),)
        case DropVerdict(flow.ticket, verdict, reasons, row) if flow.stage is Stage.JUDGING:
            row = flow.row if row is None else row
            return _log(flow._replace(row=row, judged=(verdict, reasons), rejection=(), note=()))
        case GoOn(job, settle_s):
            return _go_on(flow, job, settle_s)
        case Try() if flow.stage in _IDLE:
            return flow.to(Stage.TESTING)._replace(home=flow.stage), (Drive(),)
        case SessionOpen() if flow.stage is Stage.PROTOCOL:
            return flow.to(Stage.DEVICE), ()
        case SessionClose() if flow.stage is not Stage.PROTOCOL:
            return flow.to(Stage.PROTOCOL)._replace(job=None, row=()), ()
        case Found(job) if flow.stage in {*_IDLE, Stage.HALTED}:
            return flow._replace(job=job).to(Stage.JUDGING), (Judge(job),)
        case Again(job) if flow.stage in {*_IDLE, *_VERDICT}:
            return _onward(flow, job)
        case Reject(cause) if flow.stage is Stage.RESULT and cause.strip():
            return _log(flow._replace(rejection=(plain_reason(cause.strip(), OPERATOR),)))
        case Restore() if flow.stage is Stage.RESULT and flow.rejection:
            return _log(flow._replace(rejection=()))
        case Note(text) if flow.stage is Stage.RESULT:
            note = (plain_reason(text.strip(), NOTE),) if text.strip() else ()
            if note != flow.note:  # what was noted before stays in the log
                return _log(flow._replace(note=note))
    return flow, ()


def _stop(flow: Flow) -> Outcome:
    if flow.stage in BEFORE_RELEASE:
        why_safe = "the release is off" if flow.stage is Stage.TESTING else "nothing fell"
        flow = flow.to(flow.home, f"stopped: {why_safe}")
    return flow, (Stop(),)


def _lost(flow: Flow, trouble: str) -> Outcome:
    if flow.stage not in {*BEFORE_RELEASE, Stage.LIVE, Stage.JUDGING}:
        return flow, ()
    # Where the daemon is only late, it must not go on with what was armed. A chain that fell is
    # recorded by it, and found when it is back.
    stop = (Stop(trouble.partition("\n")[0]),) if flow.stage in BEFORE_RELEASE else ()
    return flow.to(flow.home, trouble), stop


def _take_answer(flow: Flow, token: int | None) -> Outcome:
    if flow.stage is Stage.TESTING:
        return flow.to(flow.home), ()
    job = flow.job
    if job is None:
        return flow, ()
    if flow.stage is Stage.SETTLING:
        return flow.to(Stage.ARMING), (ArmRelease(job),)
    if flow.stage is Stage.ARMING:
        return flow.to(Stage.COUNTDOWN)._replace(token=token or 0, left_s=flow.countdown_s), ()
    if flow.stage is Stage.FIRING:
        return flow.to(Stage.LIVE)._replace(refusals=0), (Collect(job),)
    if flow.stage is Stage.LIVE:
        return flow.to(Stage.JUDGING), (Judge(job),)
    return flow._replace(logged=True), ()


def _effect_failed(flow: Flow, event: EffectFailure) -> Outcome:
    if flow.stage in {Stage.ARMING, Stage.FIRING}:
        return _take_refusal(flow, event)
    if flow.stage in {*BEFORE_RELEASE, Stage.LIVE, Stage.JUDGING}:
        return flow.to(flow.home, event.trouble), (GiveUp(),)
    unlogged = () if flow.logged else (GiveUp(),)
    return flow._replace(trouble=event.trouble, logged=True), unlogged


def _take_refusal(flow: Flow, event: EffectFailure) -> Outcome:
    refusals, is_firing = flow.refusals + 1, flow.stage is Stage.FIRING
    passes = event.reason in (_DISTURBED if is_firing else _PASSING)
    # Who attends has been asked, and arms again when all is well.
    give_up = () if passes and (flow.attended or refusals < LOOKS) else (GiveUp(),)
    if is_firing:
        # Whether it was let go is not known for sure when the answer is an error.
        stop = Stop(event.trouble.partition("\n")[0])
        flow = flow.to(Stage.PREPARE, event.trouble)._replace(refusals=refusals)
        return flow, (stop, *give_up)
    if flow.attended or give_up:
        return flow.to(flow.home, event.trouble), give_up
    pause = event.detail / 1000 if event.reason is RefusalReason.COOLING else LOOK_S
    return flow.to(Stage.SETTLING)._replace(refusals=refusals), (Wait(pause),)


def _go_on(flow: Flow, job: Job | None, settle_s: float) -> Outcome:
    if flow.stage is Stage.PREPARE and job is not None:
        return flow._replace(job=job).to(Stage.SETTLING), (Wait(settle_s),)
    if flow.stage is Stage.HALTED and flow.job is not None:
        return _onward(flow, Job(flow.job.run, flow.job.attempt + 1))
    # What comes after a result depends on it: it is logged first.
    if flow.stage in {Stage.DEVICE, Stage.DONE} or (flow.stage is Stage.RESULT and flow.logged):
        return _onward(flow, job)
    return flow, ()


def _onward(flow: Flow, job: Job | None) -> Outcome:
    """Go to the next attempt, unless the last ones say that it would be void too."""
    if flow.stage is Stage.RESULT and (why := why_halted(flow.row)):
        return flow.to(Stage.HALTED, why)._replace(row=()), ()
    if job is None:
        return flow.to(Stage.DONE), ()
    return flow._replace(job=job).to(Stage.PREPARE), ()


def _log(flow: Flow) -> Outcome:
    """Have a verdict logged, the drop's first or another one."""
    job = flow.job
    assert job is not None
    state, reasons = ("rejected", flow.rejection) if flow.rejection else flow.judged
    reasons += flow.note
    row = after(flow.row, job, state, reasons)
    flow = flow.to(Stage.RESULT)._replace(verdict=state, reasons=reasons, logged=False, row=row)
    return flow, (Log(job, state, reasons),)
