"""Complete results of a session, as `rig analyze` prints them."""

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from rig.analysis.gravity import GravityCheck, check_gravity
from rig.analysis.session import Analysis, Progress, analyze
from rig.analysis.summary import Incline
from rig.cache.entry import find, keep
from rig.cache.plain import from_text
from rig.clock.calibration import Calibration, Calibrator, TimeScale
from rig.plain_data import attributes, plain
from rig.protocol import reader
from rig.protocol.measurable import with_channels
from rig.protocol.protocol import Protocol
from rig.reasons import Reason, notes_in, rig_error
from rig.records import Drop, Job
from rig.results.blind import veil
from rig.results.improvements import improvements
from rig.results.known_drops import KnownDrops
from rig.session.reading import Reader, StateEntry
from rig.session.schema import RunState
from rig.threads import processors

_MOST_PROCESSES = 4
"""Each process takes 150 MB, and only work drop by drop runs in parallel."""


@dataclass(frozen=True, slots=True)
class SessionResults:
    """All results of a session, as they are stored.

    Attributes
    ----------
    analysis
        Analysis of all drops; without values if the session is blind.
    time_scales
        Calibration of each drop, by run and attempt.
    gravity
        Check of gravity by the free chain; `None` if there is no suitable chain.
    simulated
        Whether the session is simulated.
    clock
        Calibration of the clock.
    blind
        Whether measured values are withheld.
    digest
        Digest of the records by `rig.session.reading.Reader.digest`.
    complete
        Analysis with its joint fit; `None` if these are stored results.
    """

    analysis: Analysis
    time_scales: Mapping[tuple[int, int], Mapping[str, Any]]
    gravity: GravityCheck | None
    simulated: bool
    clock: Calibration
    blind: bool
    digest: str | None
    complete: Analysis | None = field(default=None, compare=False)

    @property
    def calibration(self) -> dict[str, Any]:
        """``calibration`` of `json`: the clock's calibration with the check by gravity."""
        fields, check = self.clock.said, self.gravity
        if check is None:
            return fields
        doubts = (doubt.text for doubt in check.doubts)
        return fields | {"gravity": check.json(), "notes": [*fields["notes"], *doubts]}

    @property
    def summary(self) -> tuple[Incline, ...]:
        """Means over the runs."""
        return self.analysis.summary

    def analyses(self) -> list[tuple[str, Analysis]]:
        """Return the analysis with an empty name, like those of several sessions."""
        return [("", self.analysis)]

    def records(self) -> list[dict[str, Any]]:
        """Return each drop as JSON data, superseded attempts last."""
        fields = self.json()
        return [*fields["runs"], *fields.get("superseded", [])]

    def json(self) -> dict[str, Any]:
        """Return the object that `rig analyze --json` prints."""
        head = attributes(self, "simulated", "clock=clock.details", "blind?", "calibration")
        fields = head | self.analysis.json()
        for run in (*fields["runs"], *fields.get("superseded", [])):
            run["calibration"] = self.time_scales[run["run"], run["attempt"]]
        return fields | {"measure_next": plain(improvements(self.summary))}


def protocol_of(session: Reader) -> Protocol:
    """Return the protocol stored in the session, with only the beams that its timer had.

    Timers other than our boards may have fewer beams than the protocol.
    """
    had = next((board["beams"] for _, board in session.identities() if "beams" in board), None)
    beams = None if had is None else tuple(had)
    return _read_protocol(session.protocol_text, session.protocol_source, beams)


@lru_cache(maxsize=8)
def _read_protocol(text: str, source: str, beams: tuple[int, ...] | None) -> Protocol:
    protocol = reader.parse(text, source, kept=True)
    return protocol if beams is None else with_channels(protocol, beams)


def kept_back(session: Reader) -> bool:
    """Whether a session's results are still withheld, see `rig.results.blind`."""
    return protocol_of(session).blind and not session.unblinded


def check_open(session: Reader) -> None:
    """Raise an error if a session's results are still withheld.

    Raises
    ------
    SessionError
        The session is blind.
    """
    if kept_back(session):
        raise rig_error("session_blind", path=str(session.path))


def calibration(session: Reader) -> Calibration:
    """Return the calibration of a session's clock from all records."""
    return Calibrator().look(session, protocol_of(session).reference_u)


def results(
    session: Reader, progress: Progress | None = None, *, fresh: bool = False
) -> SessionResults:
    """Return the results of a session, from the cache or by a new analysis.

    Parameters
    ----------
    session
        The open session.
    progress
        Called with the number of drops done and the total.
    fresh
        Whether to ignore the cache.
    """
    with session.snapshot():
        stored = find(SessionResults, session.digest(), fresh=fresh)
        if stored is not None:  # the course of a clock's rate is not stored
            return replace(stored, clock=calibration(session))
        new = _analyze(session, progress, fresh=fresh)
        kept: SessionResults = from_text(keep(new, new.digest))
        return replace(kept, clock=new.clock, complete=new.complete)


def _analyze(session: Reader, progress: Progress | None, *, fresh: bool) -> SessionResults:
    """Return the results of a session by a new analysis, with its joint fit."""
    protocol, clock, states = protocol_of(session), calibration(session), session.states()
    scales: dict[tuple[int, int], Mapping[str, Any]] = {}

    def scale(drop: Drop) -> TimeScale:
        scales[drop.job] = clock.describe(drop)
        return clock.scale(drop)

    digest, blind = session.digest(), kept_back(session)
    total = sum(entry.state is RunState.RECORDED for entry in states)
    known = KnownDrops(protocol, blind=blind, fresh=fresh)
    causes, arguments = rejected_drops(states), (progress, known, total, _processes())
    complete = analyze(protocol, session.drops(), scale, causes, *arguments)
    analysis = veil(complete) if blind else complete
    gravity = check_gravity(protocol, analysis.runs)
    outcome = analysis, scales, gravity, session.simulated, clock, blind, digest
    return SessionResults(*outcome, None if blind else complete)


def _processes() -> int:
    """Return the number of processes that analyse drops.

    A spawned process imports the main program's file again. Only for our own programs is it certain
    that a ``__main__`` guard protects it.
    """
    program = getattr(sys.modules["__main__"], "__file__", None) or ""
    if Path(program).stem != "rig" and Path(program).parent != Path(__file__).parents[1]:
        return 1
    return min(_MOST_PROCESSES, processors())


def complete_analysis(
    session: Reader, known: SessionResults | None = None, progress: Progress | None = None
) -> Analysis:
    """Return the analysis with its joint fit, computed again if it is not in `known` results.

    Raises
    ------
    SessionError
        The session is blind.
    """
    check_open(session)
    with session.snapshot():
        analysis = (known and known.complete) or _analyze(session, progress, fresh=False).complete
    assert analysis is not None
    return analysis


def rejected_drops(states: Iterable[StateEntry]) -> dict[tuple[int, int], tuple[Reason, ...]]:
    """Return the causes of drops that the operator rejected, by run and attempt."""
    last = last_entries(states).items()
    return {job: entry.reasons for job, entry in last if entry.state is RunState.REJECTED}


def notes(session: Reader) -> dict[Job, str]:
    """Return the operators' latest notes on drops, in order of recording."""
    last = last_entries(session.states()).items()
    texts = {job: " · ".join(notes_in(entry.reasons)) for job, entry in last}
    return {job: text for job, text in texts.items() if text}


def last_entries(states: Iterable[StateEntry]) -> dict[Job, StateEntry]:
    """Return the latest entry of each drop in the log of states."""
    return {Job(entry.run, entry.attempt): entry for entry in states}
