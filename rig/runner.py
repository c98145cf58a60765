"""The headless runner: carries out a protocol's plan, drop by drop, on one session file."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.analysis.drop import analyze_drop
from rig.daemon.interrupts import Interrupts
from rig.daemon.station import DISCARD, Station
from rig.errors import DeviceError, InputError, SessionError
from rig.link.messages import Reason
from rig.link.refusals import DeviceRefusedError
from rig.ports import completed, is_simulated, truth_file
from rig.protocol import reader
from rig.protocol.measurable import check_measurable
from rig.protocol.plan import runs
from rig.report.numbers import plus_minus
from rig.results import calibration, results
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.analysis.result import DropResult
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop

ATTEMPTS = 3
"""How often a void run is made before it stays void."""
_SETTLED = (RunState.ACCEPTED, RunState.MARGINAL, RunState.REJECTED)
_OPEN = (RunState.ARMED, RunState.FIRED, RunState.RECORDED)
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
        What stops the campaign: see `Station`.

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
    path = Path(session_path)
    fresh = completed(url, Path(source), path, seed)
    interrupts = Interrupts() if interrupts is None else interrupts
    with _session(protocol, Path(source), fresh, path) as session:
        before = _port_before(session)
        url = completed(url, Path(source), path, seed, before)
        with Station(session, url, interrupts) as station:
            Campaign(protocol, station, operator).carry_out()
        operator.say("analysing the session …")
        found = results(session)
        with interrupts.held():
            session.put_results([*found["runs"], *found.get("superseded", [])], __version__)
            session.commit()
        return found


def _port_before(session: Session) -> str:
    """Say which port the session was recorded at so far; empty for none."""
    ports = [str(identity["port"]) for _, identity in session.identities() if "port" in identity]
    return ports[-1] if ports else ""


def _session(protocol: Protocol, source: Path, url: str, path: Path) -> Session:
    """Make a session, or open the one to be continued."""
    simulated = is_simulated(url)
    if not path.exists():
        if simulated:
            truth_file(path).unlink(missing_ok=True)  # of a session that is gone
        return Session.create(path, protocol.text, source.name, simulated=simulated, origin=url)
    session = Session.open(path)
    clash = None
    if session.protocol_text != protocol.text:
        clash = SessionError(
            f"{path} was made with another protocol ({session.protocol_source})",
            "give the same protocol file to continue it, or a new session file",
        )
    elif session.simulated != simulated:
        clash = SessionError(
            f"{path} is a {'simulated' if session.simulated else 'real'} session and {url} is "
            f"{'a simulation' if simulated else 'a real port'}",
            "the two are never mixed: give a new session file",
        )
    if clash is not None:
        session.close()
        raise clash
    return session


class Campaign:
    """The plan on its way.

    Parameters
    ----------
    protocol
        The scene and plan.
    station
        Connected.
    operator
        Who prepares each drop.
    """

    def __init__(self, protocol: Protocol, station: Station, operator: Operator) -> None:
        self.protocol = protocol
        self.station = station
        self.session = station.session
        self.operator = operator
        self.plan = runs(protocol)
        self._unfired = 0  # refusals to fire in a row

    def carry_out(self) -> None:
        """Do every run that is not done yet, in order."""
        with self.station.interrupts.held():
            self.session.put_results([], __version__)  # of less than there will be
            self.session.commit()
        self._rescue()
        for run in self.plan:
            while (attempt := self._next_attempt(run)) is not None:
                self._drop(run, attempt)

    def _rescue(self) -> None:
        """Settle what an earlier connection left behind: a held drop, a run without a record."""
        held = self.station.held()
        if held is not None:
            self._fetch(*held)
        drops = {(drop.run, drop.attempt): drop for drop in self.session.drops()}
        for run in self.plan:
            entry = self.session.latest_state(run.number)
            if entry is None or entry.state not in _OPEN:
                continue
            drop = drops.get((run.number, entry.attempt))
            if drop is not None:
                self._judge(run, drop)
            else:
                why = ("the connection ended before the drop was recorded",)
                self.station.state(run.number, entry.attempt, RunState.INTERRUPTED, why)

    def _fetch(self, run: int, attempt: int) -> None:
        """Take the drop that the device holds, if it is one of this session's."""
        fired = (run, attempt, RunState.FIRED)
        if fired not in ((e.run, e.attempt, e.state) for e in self.session.states()):
            raise DeviceError(
                f"the device holds a drop (run {run}, attempt {attempt}) of another session",
                f"continue that session first; {DISCARD}",
            )
        self.operator.say(f"fetching run {run}, attempt {attempt}, from the device")
        self.station.fetch(run, attempt)

    def _next_attempt(self, run: Run) -> int | None:
        """Number of the next attempt at a run; `None` when the run is done with."""
        entries = [entry for entry in self.session.states() if entry.run == run.number]
        if not entries:
            return 1
        if entries[-1].state in _SETTLED:
            return None
        void = sum(entry.state is RunState.VOID for entry in entries)
        return None if void >= ATTEMPTS else entries[-1].attempt + 1

    def _drop(self, run: Run, attempt: int) -> None:
        """Prepare, release, record and judge one drop."""
        self._prepare(run, attempt)
        station = self.station
        token = self._arm(run, attempt)
        # A chain that falls is recorded to the end: it took somebody minutes to hang.
        with station.interrupts.held():
            try:
                if not self._fire(run, attempt, token):
                    return
                drop = station.collect(run.number, attempt)
            except KeyboardInterrupt:
                self._interrupted(run, attempt, "interrupted by the operator")
                raise
        self._judge(run, drop)

    def _prepare(self, run: Run, attempt: int) -> None:
        """Have the chains hung and let them come to rest."""
        again = f", attempt {attempt}" if attempt > 1 else ""
        if self.operator.ask is not None:
            self.operator.ask(f"run {run.number} of {len(self.plan)}{again}: {what_to_hang(run)}")
        settle = self.protocol.plan.settle
        clock = calibration(self.session).device
        if clock is None or clock.u > _CLOCK_U:
            settle = max(settle, _CLOCK_S)
        self.station.wait(settle)

    def _arm(self, run: Run, attempt: int) -> int:
        """Arm; let the release cool, and ask for free beams and a closed emergency stop."""
        looks = 0
        while True:
            try:
                return self.station.arm(run.number, attempt, self.protocol)
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
        self.station.wait(refusal.detail / 1000 if cooling else 1.0)

    def _fire(self, run: Run, attempt: int, token: int) -> bool:
        """Let go; `False` when the device would not and the drop can be prepared again."""
        try:
            self.station.fire(token)
        except DeviceRefusedError as refusal:
            self._interrupted(run, attempt, refusal.message)
            self._unfired += 1
            alone = self.operator.ask is None
            if refusal.reason not in _DISTURBED or (alone and self._unfired >= _LOOKS):
                raise
            self.operator.say(f"not fired: {refusal.message}; {refusal.hint}")
            return False
        self._unfired = 0
        return True

    def _interrupted(self, run: Run, attempt: int, why: str) -> None:
        with suppress(DeviceError):
            self.station.abort()
        self.station.state(run.number, attempt, RunState.INTERRUPTED, (why,))

    def _judge(self, run: Run, drop: Drop) -> None:
        """Analyse a recorded drop and log the verdict."""
        scale = calibration(self.session).scale(drop)
        result = analyze_drop(self.protocol, run, drop, scale)
        self.station.state(run.number, drop.attempt, RunState(result.verdict), result.reasons)
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
