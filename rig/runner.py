"""The headless runner: carries out a protocol's plan, drop by drop, on one session file."""

from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import NamedTuple

from rig.analysis.result import DropResult
from rig.campaign import machine
from rig.campaign.machine import Effect, Event, Flow, Stage, step
from rig.campaign.plan import describe_setup, job_to_judge, next_job, rest_s
from rig.campaign.voids import voids_of
from rig.daemon.client import Client
from rig.daemon.connecting import connect
from rig.errors import DeviceError
from rig.link.refusals import DeviceRefusedError
from rig.protocol import reader
from rig.protocol.measurable import check_recordable
from rig.protocol.protocol import Protocol
from rig.recorder.interrupts import Interrupts
from rig.recorder.run_lines import plan_lines
from rig.records import Job
from rig.report.templates import sentence
from rig.results.live import LiveAnalysis
from rig.results.whole import SessionResults, results
from rig.session.schema import RunState
from rig.session.store import Session

_FALL = (machine.FireRelease, machine.Collect, machine.Stop)


class Operator(NamedTuple):
    """Whoever stands at the rig.

    Attributes
    ----------
    say
        Shows one line of narration.
    ask
        Shows a request and returns when it is done; `None` when nobody is there (``--yes``).
    """

    say: Callable[[str], None]
    ask: Callable[[str], object] | None = None


def run_protocol(
    source: str,
    url: str,
    session_path: str,
    operator: Operator,
    seed: int | None = None,
    socket: Path | None = None,
) -> SessionResults:
    """Carry out a plan, or what is left of it, and analyse the session; only in the main thread.

    Ctrl-C and SIGTERM stop it where no record is torn apart.

    Parameters
    ----------
    source
        The protocol file.
    url
        The port.
    session_path
        A new file, or the session of this protocol to be continued.
    operator
        Who prepares each drop and is told about it.
    seed
        Of a simulation.
    socket
        Of the daemon to go through: see `rig.daemon.connecting.connect`.

    Raises
    ------
    InputError, SessionError
        The protocol or the session cannot be used.
    DeviceError
        The device is in trouble; what was measured is in the session, which can be continued.
    """
    protocol = reader.read(source)
    check_recordable(protocol)
    interrupts = Interrupts()
    with interrupts.caught():
        with closing(connect(url, operator.say, interrupts, socket)) as rig:
            fetched = rig.open_session(source, session_path, seed)
            if fetched is not None:
                operator.say("fetching run {}, attempt {}, from the device".format(*fetched))
            campaign = Campaign(protocol, rig, operator, interrupts)
            campaign.carry_out()
            rig.close_session()
        # The owner of the port has let go of the file: results are the runner's own business.
        with interrupts.let_through(), Session.open(session_path, readonly=True) as session:
            operator.say("analysing the session …")
            return results(session)


class Campaign:
    """Drives a plan on its way: carries out what it wants, one effect after the other.

    Parameters
    ----------
    protocol
        The scene and plan.
    rig
        With the session open.
    operator
        Who prepares each drop.
    interrupts
        What stops the campaign.
    """

    def __init__(
        self, protocol: Protocol, rig: Client, operator: Operator, interrupts: Interrupts
    ) -> None:
        self.protocol = protocol
        self.rig = rig
        self.session = rig.session
        self.operator = operator
        self.interrupts = interrupts
        self.plan = {run.number: run for run in protocol.runs()}
        self._log = self.session.states()
        attended, row = operator.ask is not None, voids_of(self._log).row
        self.flow = Flow(Stage.DEVICE, countdown_s=0.0, attended=attended, row=row)
        self.live = LiveAnalysis(self.session.path)
        self._clock_u: float | None = None
        self._result: DropResult  # of the drop judged last
        self._refusal: DeviceRefusedError  # the last one

    def carry_out(self) -> None:
        """Do every run that is not done yet, in order, unless voids show that it is no use.

        Raises
        ------
        DeviceError
            The device is in trouble, or refuses what nobody there can help.
        """
        effects: list[Effect] = []
        while effects or self.flow.stage not in {Stage.DONE, Stage.HALTED}:
            event = self._carry_out(effects.pop(0)) if effects else self._next()
            if event is not None:
                self.flow, wanted = step(self.flow, event)
                effects += wanted
        if self.flow.stage is Stage.HALTED:
            why, _, hint = self.flow.trouble.partition("\n")
            self.operator.say(f"stopped: {why}\n  hint: {hint} (the same command continues)")

    def _next(self) -> Event:
        """Say what the operator would: at each stage where the campaign waits for one."""
        if self.flow.stage is Stage.COUNTDOWN:
            return machine.Tick(0.0)
        self._log += self.session.states(after=len(self._log))
        lines = plan_lines(self.plan.values(), self._log)
        unjudged = job_to_judge(lines)
        if unjudged is not None and self.flow.stage is not Stage.RESULT:
            return machine.Found(unjudged)
        job = unjudged or next_job(lines, voids_of(self._log).counts())
        if self.flow.stage is not Stage.PREPARE or job is None:
            return machine.GoOn(job)
        self._request(job)
        return machine.GoOn(job, self._rest_s())

    def _request(self, job: Job) -> None:
        """Ask the operator to prepare the drop, or to remove what prevents it."""
        trouble = self.flow.trouble.replace("\n", "; ")
        unfired = trouble and job != self.flow.job  # an attempt that was armed counts
        if unfired:
            self.operator.say(f"not fired: {trouble}")
        if self.operator.ask is None:
            return
        again = f", attempt {job.attempt}" if job.attempt > 1 else ""
        request = f"run {job.run} of {len(self.plan)}{again}: {describe_setup(self.plan[job.run])}"
        with self.interrupts.let_through():
            self.operator.ask(f"not armed: {trouble}" if trouble and not unfired else request)

    def _rest_s(self) -> float:
        """How long everything rests before the release; a clock once known well enough stays so."""
        if rest_s(0.0, self._clock_u) > 0.0:
            clock = self.live.clock(self.session).device
            self._clock_u = None if clock is None else clock.u
        return rest_s(self.protocol.plan.settle, self._clock_u)

    def _carry_out(self, effect: Effect) -> Event | None:
        """Carry one effect out, and return what came of it.

        Once the release is fired this stays until the drop is recorded: preparing it took minutes.
        """
        if isinstance(effect, machine.GiveUp):
            raise self._refusal
        token = None
        try:
            match effect:
                case machine.Stop(reason):
                    self._stop(reason)
                    return None
                case machine.Wait(seconds):
                    self.rig.wait(seconds)
                case machine.ArmRelease(job):
                    token = self.rig.arm(*job)
                case machine.FireRelease(armed):
                    self.rig.fire(armed)
                case machine.Collect(job):
                    self.rig.collect(*job)
                case machine.Judge(job):
                    drop = self.rig.collect(*job)  # as it is in the session
                    with self.interrupts.let_through():
                        result = self._result = self.live.judge(self.session, drop)
                    return machine.DropVerdict(self.flow.ticket, result.verdict, result.reasons)
                case machine.Log(job, state, reasons):
                    self.rig.log_state(*job, RunState(state), reasons)
                    self.operator.say(sentence("drop", self._result, len(self.plan)))
        except DeviceRefusedError as refusal:
            self._refusal = refusal
            return machine.effect_failure(self.flow.ticket, refusal)
        except KeyboardInterrupt:
            if isinstance(effect, _FALL):
                self._stop("interrupted by the operator")
            raise
        return machine.EffectDone(self.flow.ticket, token)

    def _stop(self, why: str) -> None:
        with suppress(DeviceError):
            self.rig.stop(why)
