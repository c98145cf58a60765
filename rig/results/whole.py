"""The whole analysis of a session: what `rig analyze` says."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.analysis.gravity import check_gravity
from rig.analysis.session import analyze
from rig.cache.entry import CacheEntry
from rig.clock.calibration import Calibrator
from rig.protocol import reader
from rig.protocol.measurable import with_gates
from rig.reasons import notes_in
from rig.records import Job
from rig.results.blind import check_open, kept_back, veiled
from rig.results.improvements import improvements
from rig.results.known_drops import KnownDrops, edges_digest
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.analysis.gravity import GravityCheck
    from rig.analysis.session import Analysis, Progress
    from rig.analysis.summary import Incline
    from rig.clock.calibration import Calibration, TimeScale
    from rig.protocol.protocol import Protocol
    from rig.reasons import Reason
    from rig.records import Drop
    from rig.session.reading import Reader

_MOST_PROCESSES = 4
"""Each takes 150 MB, and what is not done drop by drop is done by one."""


class Finished(NamedTuple):
    """What is kept of a session, from which all results follow at once.

    Attributes
    ----------
    analysis
        Of all drops, without what only a joint fit needs; veiled where the session is blind.
    time_scales
        The calibration that each drop has, by run and attempt.
    edges
        A digest of the edges of each drop that has any.
    """

    analysis: Analysis
    time_scales: Mapping[tuple[int, int], Mapping[str, Any]]
    edges: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SessionResults:
    """All that follows from a session.

    Attributes
    ----------
    analysis, time_scales, edges
        See `Finished`.
    gravity
        What the free chain says of it; `None` where there is none that can be asked.
    simulated
        Whether no chain ever fell.
    clock
        The time scale.
    blind
        Whether what was measured is kept back.
    digest
        Of the records, as `rig.session.reading.Reader.digest` gives it.
    complete
        The analysis with its joint fit, where that was just made and asked for.
    """

    analysis: Analysis
    time_scales: Mapping[tuple[int, int], Mapping[str, Any]]
    edges: tuple[str, ...]
    gravity: GravityCheck | None
    simulated: bool
    clock: Calibration
    blind: bool
    digest: str | None
    complete: Analysis | None = None

    @property
    def calibration(self) -> dict[str, Any]:
        """``calibration`` of `json`: what is known of the clock, what free fall says included."""
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
        """Return the analysis of each session by its name, which alone needs none."""
        return [("", self.analysis)]

    def records(self) -> list[dict[str, Any]]:
        """Return each drop as JSON has it, those with a later attempt last."""
        fields = self.json()
        return [*fields["runs"], *fields.get("superseded", [])]

    def json(self) -> dict[str, Any]:
        """As `rig analyze --json` prints it."""
        fields = self.analysis.json()
        for run in (*fields["runs"], *fields.get("superseded", [])):
            run["calibration"] = self.time_scales[run["run"], run["attempt"]]
        head = {"simulated": self.simulated, "clock": self.clock.details}
        head |= {"blind": True} if self.blind else {}
        better = [improvement.json() for improvement in improvements(self.analysis.summary)]
        return head | {"calibration": self.calibration} | fields | {"measure_next": better}


def protocol_of(session: Reader) -> Protocol:
    """Read the protocol as the session keeps it, with the beams that its timer had.

    Other timers may have had fewer than the protocol; a board's beams are those of the protocol.
    """
    protocol = reader.parse(session.protocol_text, session.protocol_source, kept=True)
    had = next((board["beams"] for _, board in session.identities() if "beams" in board), None)
    return protocol if had is None else with_gates(protocol, had)


def calibration(session: Reader) -> Calibration:
    """Calibrate a session's clock from everything it recorded."""
    return Calibrator().look(session, protocol_of(session).reference_u)


def results(
    session: Reader,
    progress: Progress | None = None,
    drops: KnownDrops | None = None,
    *,
    fresh: bool = False,
    with_joint_fit: bool = False,
) -> SessionResults:
    """Return the results of a session: those that are kept, or else analyse it.

    Parameters
    ----------
    session
        Open, for reading at least.
    progress
        Called with the number of drops done and the number of all.
    drops
        What its drops say by themselves, where a live analysis has found that out.
    fresh
        Whether to analyse it in any case.
    with_joint_fit
        Whether a joint fit that is made may stay in memory, for `complete_analysis`.
    """
    protocol = protocol_of(session)
    complete = None
    with session.snapshot():
        digest, blind = session.digest(), kept_back(session, protocol)
        entry = CacheEntry(Finished, digest, fresh=fresh)
        clock = Calibrator().look(session, protocol.reference_u)
        finished = entry.find()
        if finished is None:
            drops = drops or KnownDrops(protocol, blind=blind, fresh=fresh)
            complete, scales, edges = _analyze(session, protocol, clock, drops, progress)
            stored = veiled(complete) if blind else replace(complete, joint=None, adjusted={})
            finished = entry.keep(Finished(stored, scales, edges))
    gravity = check_gravity(protocol, finished.analysis.runs)
    held = complete if with_joint_fit and not blind else None
    return SessionResults(*finished, gravity, session.simulated, clock, blind, digest, held)


def _analyze(
    session: Reader,
    protocol: Protocol,
    clock: Calibration,
    known_drops: KnownDrops,
    progress: Progress | None,
) -> tuple[Analysis, dict[tuple[int, int], dict[str, Any]], tuple[str, ...]]:
    """Analyse all drops, read one by one, with their time scales and digests of their edges."""
    scales: dict[tuple[int, int], dict[str, Any]] = {}
    edges: list[str] = []

    def scale(drop: Drop) -> TimeScale:
        scales[drop.run, drop.attempt] = clock.describe(drop)
        edges.extend([edges_digest(drop)] if drop.edges else [])
        return clock.scale(drop)

    total = sum(entry.state is RunState.RECORDED for entry in session.states())
    drops, causes = session.drops(), rejected(session)
    analysis = analyze(protocol, drops, scale, causes, progress, known_drops, total, _processors())
    return analysis, scales, tuple(edges)


def _processors() -> int:
    """Return how many processors may be used.

    Each process but the first runs the main program's file once more up to its guard, and only of
    this program's own is it known that it has one.
    """
    program = getattr(sys.modules["__main__"], "__file__", None) or ""
    if Path(program).stem != "rig" and Path(program).parent != Path(__file__).parents[1]:
        return 1
    return min(_MOST_PROCESSES, os.cpu_count() or 1)


def complete_analysis(
    session: Reader, results: SessionResults, progress: Progress | None = None
) -> Analysis:
    """Return the analysis with its joint fit; where only results were kept it is made again.

    Raises
    ------
    SessionError
        The session is blind.
    """
    return results.complete or detailed(session, progress)[0]


def detailed(session: Reader, progress: Progress | None = None) -> tuple[Analysis, Calibration]:
    """Analyse a session and keep everything, each edge's rod too.

    Raises
    ------
    SessionError
        The session is blind.
    """
    protocol = protocol_of(session)
    check_open(session, protocol)
    with session.snapshot():
        clock = Calibrator().look(session, protocol.reference_u)
        return _analyze(session, protocol, clock, KnownDrops(protocol), progress)[0], clock


def rejected(session: Reader) -> dict[tuple[int, int], tuple[Reason, ...]]:
    """Drops whose last state is that the operator rejected them, with the causes."""
    last = {(entry.run, entry.attempt): entry for entry in session.states()}
    return {key: entry.reasons for key, entry in last.items() if entry.state is RunState.REJECTED}


def notes(session: Reader) -> dict[Job, str]:
    """What operators noted to drops, of each the latest note, in order of recording."""
    last = {Job(entry.run, entry.attempt): entry for entry in session.states()}
    texts = {job: " · ".join(notes_in(entry.reasons)) for job, entry in last.items()}
    return {job: text for job, text in texts.items() if text}
