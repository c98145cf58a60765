"""What the screens are drawn from: what daemon, session and campaign say, and what follows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.result import GOOD
from rig.campaign import plan
from rig.campaign.machine import BEFORE_RELEASE, Stage
from rig.campaign.voids import Voids
from rig.records import Job
from rig.vocabulary import ANY_SCENE

if TYPE_CHECKING:
    from rig.campaign.machine import Flow
    from rig.campaign.plan import RunLine
    from rig.protocol.protocol import Protocol, Run
    from rig.reasons import Reason
    from rig.results.live import SessionView
    from rig.tui.indicators import Indicators
    from rig.tui.state import DaemonState
    from rig.vocabulary import Vocabulary

SLOW_DISK_S = 0.5
"""A commit takes milliseconds; of a board that is armed nothing is heard while one lasts."""
HOT = frozenset({*BEFORE_RELEASE, Stage.LIVE})
UNDER_WAY = HOT | {Stage.JUDGING}
_ALONE = "a fired drop is recorded without this screen; in danger, switch the release's supply off"
_BETWEEN = (Stage.PREPARE, Stage.DEVICE, Stage.TESTING, Stage.DONE)
WATCHED = {"armed": Stage.COUNTDOWN, "fired": Stage.LIVE, "recorded": Stage.RESULT}
"""Where a watcher is, by the state of the drop."""


class Alarm(NamedTuple):
    """What is wrong, and what to do."""

    message: str
    hint: str = ""


class StopAnswer(NamedTuple):
    """What became of the latest STOP: sent at a time (monotonic, s), `heard` once that is known."""

    at_s: float
    heard: bool | None = None


@dataclass(frozen=True, slots=True)
class Model:
    """One moment.

    Attributes
    ----------
    voids
        What the log says of them.
    connected
        Whether the daemon is heard.
    driving
        Whether this screen has control of the rig.
    now_s
        A clock that only goes on.
    silence
        Why the daemon is not heard.
    offline
        Whether only a file is looked at.
    unreadable
        Why the session file cannot be read.
    read
        How many of its drops were analysed so far.
    stop
        What became of the latest STOP.
    disk_s
        How long the disk has been at one write.
    page
        The page that is shown.
    idle
        Whether no rig was ever asked for or heard: nothing is wrong with that.
    """

    state: DaemonState
    flow: Flow
    indicators: Indicators
    view: SessionView | None = None
    voids: Voids = field(default_factory=Voids)
    connected: bool = False
    driving: bool = False
    now_s: float = 0.0
    silence: str = ""
    port: str = ""
    offline: bool = False
    unreadable: str = ""
    read: int = 0
    stop: StopAnswer | None = None
    disk_s: float = 0.0
    page: str = ""
    idle: bool = False

    @property
    def protocol(self) -> Protocol | None:
        """The session's protocol; `None` before it is read."""
        return self.view.protocol if self.view else None

    @property
    def runs(self) -> tuple[RunLine, ...]:
        """The plan as it stands, our own latest verdict in it."""
        flow, job = self.flow, self.flow.job
        if flow.stage is not Stage.RESULT or job is None:
            return self.state.runs
        return tuple(
            line._replace(state=flow.verdict, attempt=job.attempt) if line.run == job.run else line
            for line in self.state.runs
        )

    @property
    def next_job(self) -> Job | None:
        """The attempt that comes next; `None` when the plan is done."""
        if self.flow.stage is Stage.PREPARE and self.flow.job is not None:
            return plan.again(self.runs, self.flow.job.run)
        return plan.next_job(self.runs, self.voids.counts(self.runs))

    @property
    def job(self) -> Job | None:
        """The attempt that the page is about: the one in hand, or that would be next."""
        latest = self.view.jobs[-1] if self.view and self.view.jobs else None
        if self.offline:
            return latest
        drop = self.state.section("drop")
        if drop and not self.driving:
            return Job(drop["run"], drop["attempt"])
        if self.flow.stage in _BETWEEN:
            return latest if self.page == "result" and latest else self.next_job
        return self.flow.job

    @property
    def settle_s(self) -> float:
        """How long the chains rest before the next drop."""
        if self.view is None:
            return 0.0
        clock = self.view.clock.device
        return plan.rest_s(self.view.protocol.plan.settle, clock.u if clock else None)

    @property
    def loading(self) -> str:
        """Say that the session is being read, where it is not there yet; empty where it is."""
        waits = self.offline or bool(self.state.section("session"))
        if self.view is not None or self.unreadable or not waits:
            return ""
        return f"Loading the session: {self.read} drops so far …"

    @property
    def stage(self) -> Stage:
        """Where the session is: by our own flow, or as seen by a watcher."""
        if self.driving or not self.connected:
            return self.flow.stage
        seen = WATCHED.get(str(self.state.section("drop").get("state")))
        return self.flow.stage if seen is None else seen

    @property
    def hot(self) -> bool:
        """Whether something may fall, or does: nothing may stand over that."""
        return self.stage in HOT

    @property
    def words(self) -> Vocabulary:
        """The words of the scene."""
        return ANY_SCENE if self.protocol is None else self.protocol.vocabulary

    @property
    def run(self) -> Run | None:
        """The current planned run."""
        if self.view is None or self.job is None:
            return None
        return self.view.plan.get(self.job.run)

    @property
    def verdict(self) -> tuple[str, tuple[Reason, ...]]:
        """Verdict and reasons of the attempt in hand; empty before there are any."""
        if self.flow.stage is Stage.RESULT and self.flow.job == self.job:
            return self.flow.verdict, self.flow.reasons
        line = self.state.line(self.job.run) if self.job else None
        if line is None or self.job is None or line.attempt != self.job.attempt:
            return "", ()
        return line.state, line.reasons

    @property
    def replaced(self) -> Job | None:
        """The latest good attempt before the one in hand, whose place it takes; `None` for none."""
        if self.view is None or self.job is None:
            return None
        run, attempt = self.job
        earlier = [
            job
            for job, result in self.view.results.items()
            if job.run == run and job.attempt < attempt and result.verdict in GOOD
        ]
        return earlier[-1] if earlier else None

    @property
    def simulated(self) -> bool:
        """Whether a stamp is needed."""
        return self.state.simulated or bool(self.view and self.view.simulated)

    @property
    def blind(self) -> bool:
        """Whether what this session measured is kept back."""
        return bool(self.state.section("session").get("blind") or (self.view and self.view.blind))


def alarm(model: Model) -> Alarm | None:
    """Name what is most wrong now; `None` when all is well."""
    if not model.connected and not model.idle:
        silence, _, hint = model.silence.partition("\n")
        begun = model.flow.stage is not Stage.PROTOCOL
        parts = [hint, "reconnecting", *[_ALONE] * begun]
        message = f"no daemon: {silence or 'connecting'}"
        return Alarm(message, "; ".join(filter(None, parts)))
    if model.disk_s > SLOW_DISK_S:
        return Alarm(
            f"the disk has not finished a write for {model.disk_s:.1f} s",
            "nothing is lost, and an armed board has switched itself off; check whether the disk "
            "is full, asleep or on a network, and whether another program uses the file",
        )
    link, error = model.state.section("link"), model.state.section("error")
    if link.get("state") == "down" or (link.get("state") == "opening" and error):
        why, wait = link.get("error") or error, link.get("retry_s")
        again = f" in {float(wait):.0f} s" if wait is not None else ""
        return Alarm(
            f"the port is lost: {why.get('message', '')}",
            f"reconnecting{again}; {why.get('hint') or 'check cable and power'}",
        )
    if error:
        return Alarm(str(error.get("message", "")), str(error.get("hint", "")))
    for trouble in (model.flow.trouble, model.unreadable):
        if trouble:
            message, _, hint = trouble.partition("\n")
            return Alarm(message, hint)
    return None
