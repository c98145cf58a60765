"""The whole analysis of a session: what `rig analyze` says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.analysis.gravity import check_gravity
from rig.analysis.session import analyze
from rig.clock.calibration import Calibrator
from rig.protocol import reader
from rig.protocol.measurable import with_gates
from rig.reasons import notes_in
from rig.records import Job
from rig.results.blind import check_open, kept_back, veiled
from rig.results.improvements import improvements
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableMapping

    from rig.analysis.gravity import GravityCheck
    from rig.analysis.identified import Identified
    from rig.analysis.session import Analysis, Progress
    from rig.clock.calibration import Calibration
    from rig.protocol.protocol import Protocol
    from rig.reasons import Reason
    from rig.records import Drop
    from rig.session.reading import Reader


@dataclass(frozen=True, slots=True)
class SessionResults:
    """All that follows from a session.

    Attributes
    ----------
    simulated
        Whether no chain ever fell.
    analysis
        Of all drops.
    clock
        The time scale.
    gravity
        What the free chain says of it; `None` where there is none that can be asked.
    time_scales
        The calibration that each drop has, by run and attempt.
    blind
        Whether what was measured is kept back.
    """

    simulated: bool
    analysis: Analysis
    clock: Calibration
    gravity: GravityCheck | None
    time_scales: Mapping[tuple[int, int], Mapping[str, Any]]
    blind: bool = False

    @property
    def calibration(self) -> dict[str, Any]:
        """``calibration`` of `json`: what is known of the clock, the free chain's word included."""
        return self.clock.said | _checked(self.clock.said["notes"], self.gravity)

    def records(self) -> list[dict[str, Any]]:
        """Return each drop as JSON has it, those with a later attempt last."""
        found = self.json()
        return [*found["runs"], *found.get("superseded", [])]

    def json(self) -> dict[str, Any]:
        """As `rig analyze --json` prints it."""
        said = self.analysis.json()
        for run in (*said["runs"], *said.get("superseded", [])):
            run["calibration"] = self.time_scales[run["run"], run["attempt"]]
        head = {"simulated": self.simulated, "clock": self.clock.details}
        head |= {"blind": True} if self.blind else {}
        better = [one.json() for one in improvements(self.analysis.summary)]
        return head | {"calibration": self.calibration} | said | {"measure_next": better}


def protocol_of(session: Reader) -> Protocol:
    """Read the protocol as the session keeps it, with the beams that its timer had.

    Other timers may have had fewer than the protocol; a board's beams are those of the protocol.
    """
    protocol = reader.parse(session.protocol_text, session.protocol_source, kept=True)
    had = next((one["beams"] for _, one in session.identities() if "beams" in one), None)
    return protocol if had is None else with_gates(protocol, had)


def calibration(session: Reader) -> Calibration:
    """Calibrate a session's clock from everything it recorded."""
    return Calibrator().look(session, protocol_of(session).reference_u)


def results(
    session: Reader,
    progress: Progress | None = None,
    known: MutableMapping[Job, Identified] | None = None,
) -> SessionResults:
    """Analyse a session.

    Parameters
    ----------
    session
        Open, for reading at least.
    progress
        Called with the number of drops done and the number of all.
    known
        What was found out before about its drops, as `rig.analysis.drop.fit_drop` takes it.
    """
    protocol = protocol_of(session)
    found, clock, drops = _analysed(session, protocol, progress, known)
    by_key = {(drop.run, drop.attempt): drop for drop in drops}
    cases = [(run, by_key[run.run.number, run.attempt]) for run in found.runs]
    blind = kept_back(session, protocol)
    checked = [] if blind else [(run, drop, clock.scale(drop)) for run, drop in cases]
    return SessionResults(
        session.simulated,
        veiled(found) if blind else found,
        clock,
        check_gravity(protocol, checked),
        {key: clock.used(drop) for key, drop in by_key.items()},
        blind,
    )


def _checked(notes: list[str], check: GravityCheck | None) -> dict[str, Any]:
    """Add to a calibration what the free chain says of it."""
    if check is None:
        return {}
    if not check.agrees:
        notes = [
            *notes,
            f"the free chain falls with {check.measured.value:.4f} ± {check.measured.expanded:.4f} "
            f"m/s², the protocol says {check.stated.value:.4f} (Eₙ {check.normalized_error:.1f}): "
            "the clock, the beams' heights, the air or the protocol's gravity is not as stated",
        ]
    return {"gravity": check.json(), "notes": notes}


def detailed(session: Reader, progress: Progress | None = None) -> tuple[Analysis, Calibration]:
    """Analyse a session and keep everything, each edge's rod too.

    Raises
    ------
    SessionError
        The session is blind.
    """
    protocol = protocol_of(session)
    check_open(session, protocol)
    return _analysed(session, protocol, progress)[:2]


def _analysed(
    session: Reader,
    protocol: Protocol,
    progress: Progress | None,
    known: MutableMapping[Job, Identified] | None = None,
) -> tuple[Analysis, Calibration, list[Drop]]:
    with session.snapshot():
        clock = Calibrator().look(session, protocol.reference_u)
        drops = list(session.drops())
        causes = rejected(session)
    found = analyze(protocol, drops, clock.scale, causes, progress, known)
    return found, clock, drops


def rejected(session: Reader) -> dict[tuple[int, int], tuple[Reason, ...]]:
    """Drops whose last state is that the operator rejected them, with the causes."""
    last = {(entry.run, entry.attempt): entry for entry in session.states()}
    return {key: entry.reasons for key, entry in last.items() if entry.state is RunState.REJECTED}


def notes(session: Reader) -> dict[Job, str]:
    """What operators noted to drops, of each the latest note, in order of recording."""
    last = {Job(entry.run, entry.attempt): entry for entry in session.states()}
    found = {job: " · ".join(notes_in(entry.reasons)) for job, entry in last.items()}
    return {job: text for job, text in found.items() if text}


def tick_rates(session: Reader) -> dict[int, float]:
    """Calibrated tick rate of each run's latest drop, Hz."""
    clock = calibration(session)
    return {drop.run: clock.scale(drop).hz for drop in session.latest_drops()}
