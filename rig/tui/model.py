"""Data of the screens: state of daemon, session and campaign, and derived values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.result import GOOD
from rig.campaign import plan
from rig.campaign.machine import BEFORE_RELEASE, Flow, Stage
from rig.campaign.voids import Voids
from rig.protocol.protocol import Protocol, Run
from rig.reasons import Reason
from rig.recorder.run_lines import RunLine
from rig.records import Job
from rig.tui.indicators import Indicators
from rig.tui.state import DaemonState
from rig.vocabulary import ANY_SCENE, Vocabulary

if TYPE_CHECKING:
    from rig.results.live import SessionView

SLOW_DISK_S = 0.5
"""Duration of a disk write that is a problem, s: normal writes take milliseconds, and messages of
an armed board wait meanwhile."""
HOT = frozenset({*BEFORE_RELEASE, Stage.LIVE})
UNDER_WAY = HOT | {Stage.JUDGING}
_ALONE = "a fired drop is recorded without this screen; in danger, switch the release's supply off"
_BETWEEN = (Stage.PREPARE, Stage.DEVICE, Stage.TESTING, Stage.DONE)
WATCHED = {"armed": Stage.COUNTDOWN, "fired": Stage.LIVE, "recorded": Stage.RESULT}
"""Stage of a watcher, by the state of the drop."""


class Alarm(NamedTuple):
    """A problem, and its remedy."""

    message: str
    hint: str = ""


class StopAnswer(NamedTuple):
    """State of the latest STOP: time of sending (monotonic, s), and `heard` once known."""

    at_s: float
    heard: bool | None = None


@dataclass(frozen=True, slots=True)
class Model:
    """Data of the screens at a moment.

    Attributes
    ----------
    voids
        Void drops by the session's log.
    connected
        Whether the daemon answers.
    driving
        Whether this screen has control of the rig.
    now_s
        Monotonic time, s.
    silence
        Why the daemon does not answer.
    offline
        Whether only a file is shown.
    unreadable
        Why the session file cannot be read.
    read
        Number of its drops analysed so far.
    stop
        State of the latest STOP.
    disk_s
        Duration of the present disk write, s.
    page
        The page that is shown.
    idle
        Whether no rig was ever requested or connected, which is not a fault.
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
        """The plan with the states of its runs, including our latest verdict."""
        flow, job = self.flow, self.flow.job
        if flow.stage is not Stage.RESULT or job is None:
            return self.state.runs
        return tuple(
            line._replace(state=flow.verdict, attempt=job.attempt) if line.run == job.run else line
            for line in self.state.runs
        )

    @property
    def next_job(self) -> Job | None:
        """The next attempt; `None` when the plan is complete."""
        if self.flow.stage is Stage.PREPARE and self.flow.job is not None:
            return self.again(self.flow.job.run)
        return plan.next_job(self.runs, self.voids.counts(self.runs))

    def again(self, run: int) -> Job | None:
        """Return another attempt at a run; `None` if it is not planned."""
        return next((line.again for line in self.runs if line.run == run), None)

    @property
    def job(self) -> Job | None:
        """Attempt of the page: the present or else the next attempt."""
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
        """Rest of the chains before the next drop, s."""
        if self.view is None:
            return 0.0
        clock = self.view.clock.device
        return plan.rest_s(self.view.protocol.plan.settle, clock.u if clock else None)

    @property
    def loading(self) -> str:
        """Message while the session is being read; empty afterwards."""
        waits = self.offline or bool(self.state.section("session"))
        if self.view is not None or self.unreadable or not waits:
            return ""
        return f"Loading the session: {self.read} drops so far …"

    @property
    def stage(self) -> Stage:
        """Stage of the session: from our own flow, or for a watcher from the daemon."""
        if self.driving or not self.connected:
            return self.flow.stage
        seen = WATCHED.get(str(self.state.section("drop").get("state")))
        return self.flow.stage if seen is None else seen

    @property
    def hot(self) -> bool:
        """Whether a chain may fall or is falling, so that no dialog may open."""
        return self.stage in HOT

    @property
    def words(self) -> Vocabulary:
        """Vocabulary of the scene."""
        return ANY_SCENE if self.protocol is None else self.protocol.vocabulary

    @property
    def run(self) -> Run | None:
        """The current planned run."""
        if self.view is None or self.job is None:
            return None
        return self.view.plan.get(self.job.run)

    @property
    def verdict(self) -> tuple[str, tuple[Reason, ...]]:
        """Verdict and reasons of the present attempt; empty before the verdict."""
        if self.flow.stage is Stage.RESULT and self.flow.job == self.job:
            return self.flow.verdict, self.flow.reasons
        line = self.state.line(self.job.run) if self.job else None
        if line is None or self.job is None or line.attempt != self.job.attempt:
            return "", ()
        return line.state, line.reasons

    @property
    def previous(self) -> Job | None:
        """The latest good attempt that the present attempt replaces; `None` if there is none."""
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
        """Whether the data are simulated, and must be marked."""
        return self.state.simulated or bool(self.view and self.view.simulated)

    @property
    def blind(self) -> bool:
        """Whether the session's results are withheld."""
        return bool(self.state.section("session").get("blind") or (self.view and self.view.blind))


def alarm(model: Model) -> Alarm | None:
    """Return the most serious present problem; `None` without problems."""
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
