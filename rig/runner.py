"""The headless runner: carries out a protocol's plan, drop by drop, on one session file."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.analysis.drop import analyze_drop
from rig.calibration import Calibrator
from rig.daemon.connecting import connect
from rig.daemon.interrupts import Interrupts
from rig.errors import DeviceError, InputError
from rig.link.messages import Reason
from rig.link.refusals import DeviceRefusedError
from rig.protocol import reader
from rig.protocol.measurable import check_measurable
from rig.protocol.plan import ATTEMPTS, runs
from rig.report.numbers import plus_minus
from rig.results import results
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from rig.analysis.result import DropResult
    from rig.daemon.connecting import Rig
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop

_SETTLED = (RunState.ACCEPTED, RunState.MARGINAL, RunState.REJECTED)
_CLOCK_U = 1e-4
"""How well the device's clock must be known before a drop, relative: a resonator that is off by
0.13 % spreads a chain's edges over the wrong rods."""
_CLOCK_S = 2.0  # of clock samples are plenty for that
_LOOKS = 5  # how often to try again what a device refuses when nobody is there to help
_HELP = (Reason.GATE_BLOCKED, Reason.STOPPED)
"""Refusals that somebody at the rig can end."""
_DISTURBED = (Reason.GATE_BLOCKED, Reason.GATE_UNSTEADY, Reason.NOT_ARMED, Reason.STOPPED)
"""Refusals to fire after which the drop can be prepared again."""


@dataclass(frozen=True, slots=True)
class Operator:
    """Whoever stands at the rig.

    Attributes
    ----------
    say
        Shows one line of narration.
    ask
        Shows a request and returns when it is done; `None` when nobody is there (``--yes``).
    """

    say: Callable[[str], None]
    ask: Callable[[str], None] | None = None


def run_protocol(
    source: str,
    url: str,
    session_path: str,
    operator: Operator,
    seed: int | None = None,
    interrupts: Interrupts | None = None,
    socket: Path | None = None,
) -> dict[str, Any]:
    """Carry out a plan, or what is left of it, and analyse the session.

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
    interrupts
        What stops the campaign: see `rig.daemon.station.Station`.
    socket
        Of the daemon to go through: see `rig.daemon.connecting.connect`.

    Returns
    -------
    dict
        As `rig.results.results` gives it.

    Raises
    ------
    InputError, SessionError
        The protocol or the session cannot be used.
    DeviceError
        The device is in trouble; what was measured is in the session, which can be continued.
    """
    protocol = reader.read(source)
    if protocol.gates is None:
        raise InputError(
            f"{source} has no gates, so nothing can be measured",
            f"rig predict {source} says what the model expects",
        )
    check_measurable(protocol)
    interrupts = Interrupts() if interrupts is None else interrupts
    rig = connect(url, operator.say, interrupts, socket)
    try:
        fetched = rig.open_session(source, session_path, seed)
        if fetched is not None:
            operator.say("fetching run {}, attempt {}, from the device".format(*fetched))
        Campaign(protocol, rig, operator, interrupts).carry_out()
        rig.close_session()
    finally:
        rig.close()
    # The owner of the port has let go of the file: results are the runner's own business.
    with Session.open(session_path) as session:
        operator.say("analysing the session …")
        found = results(session)
        with interrupts.held():
            session.put_results([*found["runs"], *found.get("superseded", [])], __version__)
            session.commit()
        return found


class Campaign:
    """The plan on its way.

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
        self, protocol: Protocol, rig: Rig, operator: Operator, interrupts: Interrupts
    ) -> None:
        self.protocol = protocol
        self.rig = rig
        self.session = rig.session
        self.operator = operator
        self.interrupts = interrupts
        self.plan = runs(protocol)
        self._unfired = 0  # refusals to fire in a row
        self._calibrator = Calibrator()
        self._clock_known = False  # once well enough, always: one rate for all samples

    def carry_out(self) -> None:
        """Do every run that is not done yet, in order."""
        for run in self.plan:
            entry = self.session.latest_state(run.number)
            if entry is not None and entry.state is RunState.RECORDED:
                self._judge(run, self.rig.collect(run.number, entry.attempt))
        for run in self.plan:
            while (attempt := self._next_attempt(run)) is not None:
                self._drop(run, attempt)

    def _next_attempt(self, run: Run) -> int | None:
        """Number of the next attempt at a run; `None` when the run is done with."""
        entries = self.session.states(run.number)
        if not entries:
            return 1
        if entries[-1].state in _SETTLED:
            return None
        void = sum(entry.state is RunState.VOID for entry in entries)
        return None if void >= ATTEMPTS else entries[-1].attempt + 1

    def _drop(self, run: Run, attempt: int) -> None:
        """Prepare, release, record and judge one drop."""
        self._prepare(run, attempt)
        token = self._arm(run, attempt)
        # A chain that falls is recorded to the end: it took somebody minutes to hang.
        with self.interrupts.held():
            try:
                if not self._fire(token):
                    return
                drop = self.rig.collect(run.number, attempt)
            except KeyboardInterrupt:
                self._interrupted("interrupted by the operator")
                raise
        self._judge(run, drop)

    def _prepare(self, run: Run, attempt: int) -> None:
        """Have the chains hung and let them come to rest."""
        again = f", attempt {attempt}" if attempt > 1 else ""
        if self.operator.ask is not None:
            self.operator.ask(f"run {run.number} of {len(self.plan)}{again}: {what_to_hang(run)}")
        settle = self.protocol.plan.settle
        if not self._clock_known:
            clock = self._calibrator.look(self.session).device
            self._clock_known = clock is not None and clock.u <= _CLOCK_U
        if not self._clock_known:
            settle = max(settle, _CLOCK_S)
        self.rig.wait(settle)

    def _arm(self, run: Run, attempt: int) -> int:
        """Arm; let the release cool, and ask for free beams and a closed emergency stop."""
        looks = 0
        while True:
            try:
                return self.rig.arm(run.number, attempt)
            except DeviceRefusedError as refusal:
                looks += 1
                self._put_right(refusal, last=looks >= _LOOKS)

    def _put_right(self, refusal: DeviceRefusedError, *, last: bool) -> None:
        """End what keeps the device from arming: wait, or ask whoever is there."""
        cooling = refusal.reason is Reason.COOLING
        if refusal.reason in _HELP and self.operator.ask is not None:
            self.operator.ask(f"not armed: {refusal.message}; {refusal.hint}")
        elif last or not (cooling or refusal.reason in _HELP):
            raise refusal
        self.rig.wait(refusal.detail / 1000 if cooling else 1.0)

    def _fire(self, token: int) -> bool:
        """Let go; `False` when the device would not and the drop can be prepared again."""
        try:
            self.rig.fire(token)
        except DeviceRefusedError as refusal:
            self._interrupted(refusal.message)
            self._unfired += 1
            alone = self.operator.ask is None
            if refusal.reason not in _DISTURBED or (alone and self._unfired >= _LOOKS):
                raise
            self.operator.say(f"not fired: {refusal.message}; {refusal.hint}")
            return False
        self._unfired = 0
        return True

    def _interrupted(self, why: str) -> None:
        with suppress(DeviceError):
            self.rig.stop(why)

    def _judge(self, run: Run, drop: Drop) -> None:
        """Analyse a recorded drop and log the verdict."""
        scale = self._calibrator.look(self.session).scale(drop)
        result = analyze_drop(self.protocol, run, drop, scale)
        self.rig.log_state(run.number, drop.attempt, RunState(result.verdict), result.reasons)
        self.operator.say(narration(result, len(self.plan)))


def what_to_hang(run: Run) -> str:
    """Tell the operator what goes where."""
    if run.impact is None:
        return f"hang {run.free} for free fall"
    free = f" · free side: {run.free}" if run.free else ""
    return f"incline {run.incline_deg:g}° · impact side: {run.impact}{free}"


def narration(result: DropResult, planned: int) -> str:
    """One line about a drop."""
    run, found = result.run, {name: q.json() for name, q in result.quantities.items()}
    parts = [f"run {run.number:>{len(str(planned))}}/{planned}"]
    if run.impact is not None:
        parts.append(f"{run.incline_deg:g}° impact {run.impact}")
    if "separation_m" in found:
        parts.append(f"Δz {plus_minus(found['separation_m'], 100.0)} cm")
    if "speed_m_s" in found:
        parts.append(f"V {plus_minus(found['speed_m_s'])} m/s")
    if "release_skew_s" in found:
        parts.append(f"skew {plus_minus(found['release_skew_s'], 1000.0)} ms")
    if "gravity_m_s2" in found:
        parts.append(f"g {plus_minus(found['gravity_m_s2'])} m/s²")
    parts.append(": ".join(filter(None, [result.verdict, "; ".join(result.reasons)])))
    return "  ".join(parts)
