"""The live analysis: one session file, read again and again beside its writer.

Whoever judges a drop asks here, with a screen or without one.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from statistics import median
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.analysis.curves import model_curves
from rig.analysis.drop import DropCase
from rig.analysis.joint_fit import FEWEST
from rig.analysis.result import GOOD
from rig.analysis.session import gather, joins, overruled, planned_run, sum_up
from rig.cache.entry import CacheEntry
from rig.clock.calibration import Calibrator
from rig.protocol.plan import runs as planned_runs
from rig.records import Job
from rig.results.blind import kept_back, veiled, veiled_drop
from rig.results.known_drops import KnownDrops
from rig.results.whole import Finished, protocol_of, rejected
from rig.session.drop_check import ByteReplay
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from rig.analysis.drop import DropSummary
    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.clock.calibration import Calibration, TimeScale
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Drop
    from rig.session.reading import Reader, StateEntry

_SAME_SCALE = 5e-6
"""Relative change of the tick rate below which a drop is not analysed again: 50 nm in 10 mm."""


@dataclass(frozen=True, slots=True)
class SessionView:
    """A session as it stands on the disk.

    Attributes
    ----------
    reading
        Which reading of the file this is: what is drawn from it changes with it.
    drops, results
        Every recorded attempt, and what it says by itself.
    analysis
        Of the drops that `fitted` counts, or, before there is a joint fit, of all of them by
        themselves.
    fitted
        How many drops were fitted jointly in `analysis`; 0 for none.
    lagging
        Whether a joint fit would say more than is in `analysis`.
    curves
        The model against inclination, as `rig.analysis.curves.model_curves` gives it.
    blind
        Whether what was measured is kept back.
    unblinded
        When that of a blind session was shown; empty before.
    pace_s
        Usual time from drop to drop; `None` before the third.
    """

    path: Path
    reading: int
    protocol: Protocol
    simulated: bool
    created: str
    plan: Mapping[int, Run]
    drops: Mapping[Job, Drop]
    results: Mapping[Job, DropResult]
    scales: Mapping[Job, TimeScale]
    analysis: Analysis
    fitted: int
    lagging: bool
    curves: Mapping[str, Any]
    clock: Calibration
    states: tuple[StateEntry, ...]
    pace_s: float | None
    blind: bool = False
    unblinded: str = ""

    @property
    def jobs(self) -> tuple[Job, ...]:
        """Every recorded attempt, in order of recording."""
        return tuple(self.drops)

    @property
    def channels(self) -> tuple[int, ...]:
        """Channels of the scene's gates."""
        gates = self.protocol.gates
        return () if gates is None else tuple(gate.channel for gate in gates.gates)


class _Scene(NamedTuple):
    """What is planned, and what is kept of drops; `complete` once the timer's beams are known."""

    protocol: Protocol
    plan: dict[int, Run]
    kept: KnownDrops
    complete: bool


class _JointFit(NamedTuple):
    """What drops say fitted together; `of` is who was there, and how."""

    of: object
    analysis: Analysis

    @property
    def size(self) -> int:
        analysis = self.analysis
        return sum(result.learned for result in analysis.drops)


@dataclass(slots=True)
class LiveAnalysis:
    """Reads one session again and again, and analyses what is new.

    Parameters
    ----------
    path
        The session file.
    """

    path: Path
    _summaries: dict[Job, DropSummary] = field(default_factory=dict)
    _log: Sequence[StateEntry] | None = None
    _drops: dict[Job, Drop] = field(default_factory=dict)
    _curves: dict[str, Any] | None = None
    _joint_fit: _JointFit | None = None
    _digest: str | None = None
    _calibrator: Calibrator = field(default_factory=Calibrator)
    _replay: ByteReplay = field(default_factory=ByteReplay)
    _scene: _Scene | None = None
    _readings: int = 0
    _lock: Lock = field(default_factory=Lock)

    @property
    def done(self) -> int:
        """Drops that were read and analysed, for who waits for the first reading."""
        return len(self._summaries)

    @property
    def known(self) -> KnownDrops | None:
        """What its drops say by themselves; `None` before it was asked for any."""
        return None if self._scene is None else self._scene.kept

    def clock(self, session: Reader) -> Calibration:
        """Calibrate the session's clock from everything it recorded until now."""
        return self._calibrator.look(session, self._planned(session).protocol.reference_u)

    def judge(self, session: Reader, drop: Drop) -> DropResult:
        """Find out what one drop says by itself, as `read` does.

        Parameters
        ----------
        session
            Open.
        drop
            Recorded in it.
        """
        scene, scale = self._planned(session), self.clock(session).scale(drop)
        result = self._summary(scene, drop, scale).result
        return veiled_drop(result) if kept_back(session, scene.protocol) else result

    def read(self) -> SessionView:
        """Read the file as it is now; safe in any thread, one at a time.

        Raises
        ------
        SessionError
            The file cannot be read.
        """
        with self._lock, Session.open(self.path, readonly=True) as session:
            with session.snapshot():
                scene = self._planned(session)
                protocol = scene.protocol
                clock, states = self.clock(session), tuple(session.states())
                # An analysis is sought of new records, and as long as there is none.
                fresh = states != self._log or self._joint_fit is None
                digest = session.digest() if fresh else None
                if states != self._log:  # records are only added, and that is logged
                    checked = session.drops(self._replay)
                    self._drops = {Job(drop.run, drop.attempt): drop for drop in checked}
                    self._log = states
                causes, blind = rejected(session), kept_back(session, protocol)
            drops = self._drops
            scales = {job: clock.scale(drop) for job, drop in drops.items()}
            results = {
                job: overruled(self._summary(scene, drop, scales[job]).result, causes.get(job))
                for job, drop in drops.items()
            }
            if self._curves is None:
                self._curves = model_curves(protocol)
            self._readings += 1
            enough = sum(result.verdict in GOOD for result in results.values()) >= FEWEST
            members = self._members(results)
            behind = self._joint_fit is None or self._joint_fit.of != members
            if enough and behind and not blind:  # what is kept of a blind session says nothing
                self._look_for_kept(digest, members)
            joint = self._joint_fit if enough else None
            view = SessionView(
                path=self.path,
                reading=self._readings,
                protocol=protocol,
                simulated=session.simulated,
                created=session.meta["created"],
                plan=scene.plan,
                drops=drops,
                results=results,
                scales=scales,
                analysis=joint.analysis if joint else sum_up(protocol, results.values()),
                fitted=joint.size if joint else 0,
                lagging=enough and (joint is None or joint.of != members),
                curves=self._curves,
                clock=clock,
                states=states,
                pace_s=_pace(states),
                blind=blind,
                unblinded=session.unblinded,
            )
            return _veiled_view(view) if blind else view

    def fit_jointly(self, view: SessionView) -> None:
        """Fit all drops together, as ``rig analyze`` does; the next reading has it.

        Takes its time; safe in any thread beside `read`.

        Parameters
        ----------
        view
            From `read`.
        """
        drops = []
        for job, result in view.results.items():
            summary, drop = self._summaries[job], view.drops[job]
            case = DropCase(view.protocol, view.plan[job.run], drop, summary.scale)
            drops.append(case.adjusted(summary) if joins(view.protocol, result) else None)
        analysis = gather(view.protocol, list(view.results.values()), drops)
        self._joint_fit = _JointFit(self._members(view.results), analysis)

    def _look_for_kept(self, digest: str | None, members: object) -> None:
        """Take the analysis of these very records where one is kept."""
        if digest not in {None, self._digest}:
            finished = CacheEntry(Finished, digest).find()
            if finished is not None:
                self._joint_fit = _JointFit(members, finished.analysis)
            self._digest = digest

    def _members(self, results: Mapping[Job, DropResult]) -> object:
        return {job: (drop.verdict, self._summaries[job].scale.hz) for job, drop in results.items()}

    def _planned(self, session: Reader) -> _Scene:
        scene = self._scene
        if scene is None or not scene.complete:
            protocol = protocol_of(session)
            if scene is None or scene.protocol != protocol:
                plan = {run.number: run for run in planned_runs(protocol)}
                drops = KnownDrops(protocol, blind=kept_back(session, protocol))
                scene = _Scene(protocol, plan, drops, complete=False)
            self._scene = scene = scene._replace(complete=bool(session.identities()))
        return scene

    def _summary(self, scene: _Scene, drop: Drop, scale: TimeScale) -> DropSummary:
        """Return what a drop says by itself: known, kept or found out now."""
        job = Job(drop.run, drop.attempt)
        summary = self._summaries.get(job) or scene.kept.get(drop)
        if summary is None or abs(summary.scale.hz / scale.hz - 1.0) > _SAME_SCALE:
            case = DropCase(scene.protocol, planned_run(scene.plan, drop), drop, scale)
            summary = scene.kept[drop] = case.summary(summary)
        self._summaries[job] = summary
        return summary


def _veiled_view(view: SessionView) -> SessionView:
    """Leave out what was measured, and the edges from which it could be drawn."""
    drops = {job: replace(drop, edges=()) for job, drop in view.drops.items()}
    results = {job: veiled_drop(result) for job, result in view.results.items()}
    analysis = veiled(view.analysis)
    return replace(view, drops=drops, results=results, analysis=analysis, fitted=0, lagging=False)


def _pace(states: Sequence[StateEntry]) -> float | None:
    at = [entry.host_ns for entry in states if entry.state is RunState.RECORDED]
    gaps = [(b - a) * 1e-9 for a, b in itertools.pairwise(at) if b > a]
    return median(gaps) if len(gaps) > 1 else None
