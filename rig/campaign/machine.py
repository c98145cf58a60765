"""A plan on its way as a pure machine: event in, new stage and effects out.

Nothing here knows of screens, sockets or clocks. Whoever drives it carries the effects out and
returns what came of them, with the ticket of the effect: an answer to what was stopped meanwhile
has an old ticket and changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

from rig.campaign import events
from rig.campaign.events import Effect, Event, Stage
from rig.campaign.voids import VoidRow, after, why_halted
from rig.link.messages import RefusalReason
from rig.reasons import Reason, plain_reason
from rig.records import Job
from rig.wordings import NOTE, OPERATOR

COUNTDOWN_S = 3.0
"""From armed to fired: time to take a hand away, or to press a key."""
LOOKS = 5
"""How often what a device refuses is tried when nobody is there to help."""
LOOK_S = 1.0

BEFORE_RELEASE = (
    Stage.TESTING, Stage.SETTLING, Stage.ARMING, Stage.COUNTDOWN, Stage.FIRING
)  # fmt: skip
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


@dataclass(frozen=True, slots=True)
class Flow:
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
        The verdict and reasons that it had before it was rejected.
    trouble
        What went wrong last; empty when it is over.
    home
        Where a stage leads that ends without a drop.
    not_armed, not_fired
        Refusals in a row.
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
    trouble: str = ""
    home: Stage = Stage.PREPARE
    not_armed: int = 0
    not_fired: int = 0
    attended: bool = True
    row: VoidRow = ()

    def to(self, stage: Stage, trouble: str = "") -> Flow:
        """Go to another stage; answers to earlier effects count no more."""
        return replace(
            self, stage=stage, ticket=self.ticket + 1, trouble=trouble, home=Stage.PREPARE
        )


def step(flow: Flow, event: Event) -> Outcome:  # noqa: PLR0912 - one line an event
    """Take one event."""
    match event:
        case events.Stopped():
            return _stop(flow)
        case events.Lost(trouble):
            return _lost(flow, trouble)
        case events.Warned(trouble):
            return replace(flow, trouble=flow.trouble or trouble), ()
        case events.Answered(ticket, token):
            return _take_answer(flow, ticket, token)
        case events.EffectFailed():
            return _effect_failed(flow, event)
        case events.Tick(seconds):
            return _tick(flow, seconds)
        case events.Judged():
            return _take_verdict(flow, event)
        case events.GoOn(job, settle_s):
            return _go_on(flow, job, settle_s)
        case events.Try() if flow.stage in _IDLE:
            return replace(flow.to(Stage.TESTING), home=flow.stage), (events.Drive(),)
        case events.Opened() if flow.stage is Stage.PROTOCOL:
            return flow.to(Stage.DEVICE), ()
        case events.Closed() if flow.stage in {*_IDLE, *_VERDICT}:
            return replace(flow.to(Stage.PROTOCOL), job=None, row=()), ()
        case events.Found(job) if flow.stage in {*_IDLE, Stage.HALTED}:
            return replace(flow, job=job).to(Stage.JUDGING), (events.Judge(job),)
        case events.Again(job) if flow.stage in {*_IDLE, *_VERDICT}:
            return _onward(flow, job)
        case events.Reject(cause) if flow.stage is Stage.RESULT and cause.strip():
            if flow.verdict != "rejected":
                flow = replace(flow, judged=(flow.verdict, flow.reasons))
            return _log_again(
                flow, "rejected", (plain_reason(cause.strip(), OPERATOR), *_notes(flow))
            )
        case events.Restore() if flow.stage is Stage.RESULT and flow.verdict == "rejected":
            verdict, reasons = flow.judged
            return _log_again(flow, verdict, (*_noteless(reasons), *_notes(flow)))
        case events.Note(text) if flow.stage is Stage.RESULT:
            note = (plain_reason(text.strip(), NOTE),) if text.strip() else ()
            if note != _notes(flow):  # what was noted before stays in the log
                return _log_again(flow, flow.verdict, (*_noteless(flow.reasons), *note))
    return flow, ()


def _notes(flow: Flow) -> tuple[Reason, ...]:
    return tuple(reason for reason in flow.reasons if reason.code == NOTE)


def _noteless(reasons: tuple[Reason, ...]) -> tuple[Reason, ...]:
    return tuple(reason for reason in reasons if reason.code != NOTE)


def _stop(flow: Flow) -> Outcome:
    if flow.stage in BEFORE_RELEASE:
        message = "stopped: the release is off"
        if flow.stage is not Stage.TESTING:
            message = "stopped: nothing fell"
        return flow.to(flow.home, message), (events.Stop(),)
    return flow, (events.Stop(),)


def _lost(flow: Flow, trouble: str) -> Outcome:
    if flow.stage in BEFORE_RELEASE:
        # Where it is only late, it must not go on with what was armed.
        return flow.to(flow.home, trouble), (events.Stop(trouble.partition("\n")[0]),)
    if flow.stage in {Stage.LIVE, Stage.JUDGING}:
        # A chain that fell is recorded by the daemon, and found when it is back.
        return flow.to(flow.home, trouble), ()
    return flow, ()


def _take_answer(flow: Flow, ticket: int, token: int | None) -> Outcome:
    if ticket != flow.ticket:
        # What was stopped while the device was arming must not stay armed.
        return flow, () if token is None else (events.Stop(),)
    if flow.stage is Stage.TESTING:
        return flow.to(flow.home), ()
    job = flow.job
    if job is None:
        return flow, ()
    if flow.stage is Stage.SETTLING:
        return flow.to(Stage.ARMING), (events.ArmRelease(job),)
    if flow.stage is Stage.ARMING:
        armed = replace(flow.to(Stage.COUNTDOWN), not_armed=0)
        return replace(armed, token=token or 0, left_s=flow.countdown_s), ()
    if flow.stage is Stage.FIRING:
        return replace(flow.to(Stage.LIVE), not_fired=0), (events.Collect(job),)
    if flow.stage is Stage.LIVE:
        return flow.to(Stage.JUDGING), (events.Judge(job),)
    return replace(flow, logged=True), ()


def _effect_failed(flow: Flow, event: events.EffectFailed) -> Outcome:
    if event.ticket != flow.ticket:
        return flow, ()
    if flow.stage is Stage.ARMING:
        return _not_armed(flow, event)
    if flow.stage is Stage.FIRING:
        return _not_fired(flow, event)
    if flow.stage in {*BEFORE_RELEASE, Stage.LIVE, Stage.JUDGING}:
        return flow.to(flow.home, event.trouble), (events.GiveUp(),)
    unlogged = () if flow.logged else (events.GiveUp(),)
    return replace(flow, trouble=event.trouble, logged=True), unlogged


def _not_armed(flow: Flow, event: events.EffectFailed) -> Outcome:
    refusals = flow.not_armed + 1
    if event.reason not in _PASSING or (not flow.attended and refusals >= LOOKS):
        return flow.to(flow.home, event.trouble), (events.GiveUp(),)
    if flow.attended:  # who has been asked, and arms again when all is well
        return flow.to(flow.home, event.trouble), ()
    pause = event.detail / 1000 if event.reason is RefusalReason.COOLING else LOOK_S
    return replace(flow.to(Stage.SETTLING), not_armed=refusals), (events.Wait(pause),)


def _not_fired(flow: Flow, event: events.EffectFailed) -> Outcome:
    refusals = flow.not_fired + 1
    flow = replace(flow.to(Stage.PREPARE, event.trouble), not_fired=refusals)
    # Whether it was let go is not known for sure when the answer is an error.
    stop = events.Stop(event.trouble.partition("\n")[0])
    if event.reason not in _DISTURBED or (not flow.attended and refusals >= LOOKS):
        return flow, (stop, events.GiveUp())
    return flow, (stop,)


def _tick(flow: Flow, seconds: float) -> Outcome:
    if flow.stage is not Stage.COUNTDOWN:
        return flow, ()
    seconds_left = flow.left_s - seconds
    if seconds_left > 0.0:
        return replace(flow, left_s=seconds_left), ()
    return replace(flow.to(Stage.FIRING), left_s=0.0), (events.FireRelease(flow.token),)


def _take_verdict(flow: Flow, event: events.Judged) -> Outcome:
    if event.ticket != flow.ticket or flow.stage is not Stage.JUDGING:
        return flow, ()
    job, verdict, reasons = flow.job, event.verdict, event.reasons
    assert job is not None
    flow = replace(flow, verdict=verdict, reasons=reasons, logged=False)
    before = flow.row if event.row is None else event.row
    row = after(before, job, verdict, reasons)
    return replace(flow.to(Stage.RESULT), row=row), (events.Log(job, verdict, reasons),)


def _go_on(flow: Flow, job: Job | None, settle_s: float) -> Outcome:
    if flow.stage is Stage.PREPARE and job is not None:
        return replace(flow, job=job, not_armed=0).to(Stage.SETTLING), (events.Wait(settle_s),)
    if flow.stage is Stage.RESULT and not flow.logged:
        return flow, ()  # what comes next depends on it
    if flow.stage is Stage.HALTED and flow.job is not None:
        return _onward(flow, Job(flow.job.run, flow.job.attempt + 1))
    if flow.stage in {Stage.DEVICE, Stage.RESULT, Stage.DONE}:
        return _onward(flow, job)
    return flow, ()


def _onward(flow: Flow, job: Job | None) -> Outcome:
    """Go to the next attempt, unless the last ones say that it would be void too."""
    why = why_halted(flow.row) if flow.stage is Stage.RESULT else ""
    if why:
        return replace(flow.to(Stage.HALTED, why), row=()), ()
    if job is None:
        return flow.to(Stage.DONE), ()
    return replace(flow, job=job).to(Stage.PREPARE), ()


def _log_again(flow: Flow, state: str, reasons: tuple[Reason, ...]) -> Outcome:
    """Log the drop once more."""
    job = flow.job
    assert job is not None
    flow = replace(flow, verdict=state, reasons=reasons, logged=False)
    row = after(flow.row, job, state, reasons)
    flow = replace(flow, ticket=flow.ticket + 1, trouble="", row=row)
    return flow, (events.Log(job, state, reasons),)
