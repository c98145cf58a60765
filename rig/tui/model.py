"""Data of the screens: state of daemon, session and campaign, and derived values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.result import GOOD
from rig.campaign import plan
from rig.campaign.machine import BEFORE_RELEASE, Flow, Stage
from rig.campaign.voids import Voids
from rig.protocol.protocol import Protocol, Run
from rig.reasons import Reason, rig_error
from rig.recorder.run_lines import RunLine
from rig.records import Job
from rig.tui.actions import NEEDS_RIG, Action
from rig.tui.client import ReconnectingClient
from rig.tui.indicators import Indicators
from rig.tui.state import DaemonState
from rig.vocabulary import ANY_SCENE, Vocabulary

if TYPE_CHECKING:
    from rig.results.live import LiveAnalysis, SessionView

SLOW_DISK_S = 0.5
"""Duration of a disk write that is a problem, s: normal writes take milliseconds, and messages of
an armed board wait meanwhile."""
HOT = frozenset({*BEFORE_RELEASE, Stage.LIVE})
UNDER_WAY = HOT | {Stage.JUDGING}
_ALONE = "a fired drop is recorded without this screen; in danger, switch the release's supply off"
_BETWEEN = (Stage.PREPARE, Stage.DEVICE, Stage.TESTING, Stage.DONE)
WATCHED = {"armed": Stage.COUNTDOWN, "fired": Stage.LIVE, "recorded": Stage.RESULT}
"""Stage of a watcher, by the state of the drop."""


class StopAnswer(NamedTuple):
    """State of the latest STOP: time of sending (monotonic, s), and `heard` once known."""

    at_s: float
    heard: bool | None = None


@dataclass
class Model:
    """Data of the screens, as the parts of the program that know them write them here.

    Attributes
    ----------
    client
        Connection to the daemon.
    flow
        State of the campaign.
    offline
        Whether only a file is shown.
    state
        Latest state of the daemon.
    indicators
        State of the gates.
    live
        Analysis of the session file, while a session is open.
    view
        Latest view of the session file.
    voids
        Void drops by the session's log.
    unreadable
        Why the session file cannot be read; empty if it can.
    stop
        State of the latest STOP; `None` before the first.
    page
        The page that is shown.
    """

    client: ReconnectingClient
    flow: Flow
    offline: bool = False
    state: DaemonState = field(default_factory=DaemonState)
    indicators: Indicators = field(default_factory=Indicators)
    live: LiveAnalysis | None = None
    view: SessionView | None = None
    voids: Voids = field(default_factory=Voids)
    unreadable: str = ""
    stop: StopAnswer | None = None
    page: str = ""

    def allows(self, action: Action) -> bool:
        """Whether an action is possible now."""
        has_rig = not self.offline or action.name not in NEEDS_RIG
        # Without a rig, an operator may start with a new one.
        begins = action.name == "go_on" and self.flow.stage is Stage.PROTOCOL
        is_held = self.client.driving or begins or not action.driving
        return has_rig and is_held and self.flow.stage in action.stages

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

        def latest(line: RunLine) -> RunLine:
            verdict = line._replace(attempt=job.attempt, state=flow.verdict, reasons=flow.reasons)
            return verdict if line.run == job.run else line

        return tuple(map(latest, self.state.runs))

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
        if drop and not self.client.driving:
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
        return f"Loading the session: {self.live.done if self.live else 0} drops so far …"

    @property
    def stage(self) -> Stage:
        """Stage of the session: from our own flow, or for a watcher from the daemon."""
        if self.client.driving or not self.client.up:
            return self.flow.stage
        return WATCHED.get(str(self.state.section("drop").get("state")), self.flow.stage)

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
        return self.view.plan.get(self.job.run) if self.view and self.job else None

    @property
    def verdict(self) -> tuple[str, tuple[Reason, ...]]:
        """Verdict and reasons of the present attempt; empty before the verdict."""
        job = self.job
        lines = (line for line in self.runs if (line.run, line.attempt) == job)
        return next(((line.state, line.reasons) for line in lines), ("", ()))

    @property
    def previous(self) -> Job | None:
        """The latest good attempt that the present attempt replaces; `None` if there is none."""
        results = self.view.results if self.view else {}
        good = {job for job, result in results.items() if result.verdict in GOOD}
        present = self.job or Job(0, 0)
        earlier = (job for job in good if job.run == present.run and job < present)
        return max(earlier, default=None)

    @property
    def simulated(self) -> bool:
        """Whether the data are simulated, and must be marked."""
        is_rig = any(self.state.section(name).get("simulated") for name in ("port", "session"))
        return is_rig or bool(self.view and self.view.simulated)

    @property
    def blind(self) -> bool:
        """Whether the session's results are withheld."""
        return bool(self.state.section("session").get("blind") or (self.view and self.view.blind))


def alarm(model: Model) -> str:
    """Return the most serious present problem, and its remedy on a second line; or nothing."""
    if not model.client.up and not model.client.idle:
        silence, _, hint = model.client.silence.partition("\n")
        begun = model.flow.stage is not Stage.PROTOCOL
        parts = [hint, "reconnecting", *[_ALONE] * begun]
        return f"no daemon: {silence or 'connecting'}\n{'; '.join(filter(None, parts))}"
    if model.client.disk_s > SLOW_DISK_S:
        return rig_error("disk_unfinished", waited_s=model.client.disk_s).two_lines
    link, error = model.state.section("link"), model.state.section("error")
    if link.get("state") == "down" or (link.get("state") == "opening" and error):
        why, wait = link.get("error") or error, link.get("retry_s")
        again = f" in {float(wait):.0f} s" if wait is not None else ""
        return (
            f"the port is lost: {why.get('message', '')}\n"
            f"reconnecting{again}; {why.get('hint') or 'check cable and power'}"
        )
    if error:
        return f"{error.get('message', '')}\n{error.get('hint', '')}"
    return model.flow.trouble or model.unreadable
