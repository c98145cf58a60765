"""Live analysis: a session file, read repeatedly while another process writes it.

The verdict on a new drop comes from here, with or without a screen.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from threading import Lock
from typing import Any

from rig.analysis.curves import model_curves
from rig.analysis.drop import DropSummary
from rig.analysis.joint_fit import FEWEST
from rig.analysis.result import GOOD, DropResult
from rig.analysis.session import Analysis, drop_case, gather, overrule, plan_of, sum_up
from rig.cache.entry import find
from rig.clock.calibration import Calibration, Calibrator, TimeScale
from rig.protocol.protocol import Protocol, Run
from rig.records import Drop, Job
from rig.results.blind import veil, veiled_drop
from rig.results.known_drops import KnownDrops
from rig.results.whole import SessionResults, kept_back, protocol_of, rejected_drops
from rig.session.drop_check import ByteReplay
from rig.session.reading import Reader, StateEntry
from rig.session.schema import RunState
from rig.session.store import Session

_SAME_SCALE = 5e-6
"""Relative change of the tick rate below which a drop is not analysed again: 50 nm in 10 mm."""


@dataclass(frozen=True)
class _Scene:
    """A session's protocol with what follows from it.

    Attributes
    ----------
    plan
        Planned runs by number.
    curves
        Predictions against inclination from `rig.analysis.curves.model_curves`.
    blind
        Whether measured values are withheld.
    """

    protocol: Protocol
    plan: Mapping[int, Run]
    curves: Mapping[str, Any]
    blind: bool

    @property
    def kept(self) -> KnownDrops:
        """Cache of the drops' own summaries."""
        return KnownDrops(self.protocol, blind=self.blind)


@dataclass(frozen=True)
class SessionView(_Scene):
    """A session as it is on disk, with its results.

    Attributes
    ----------
    reading
        Number of this reading of the file, to detect changes.
    drops, results
        Every recorded attempt, and its own result.
    analysis
        Analysis of the latest joint fit; before the first, summary of all drops by themselves.
    lagging
        Whether a new joint fit is due, as drops have changed since that of `analysis`.
    """

    path: Path
    reading: int
    simulated: bool
    drops: Mapping[Job, Drop]
    results: Mapping[Job, DropResult]
    scales: Mapping[Job, TimeScale]
    analysis: Analysis
    lagging: bool
    clock: Calibration
    states: tuple[StateEntry, ...]

    @property
    def jobs(self) -> tuple[Job, ...]:
        """Every recorded attempt, in order of recording."""
        return tuple(self.drops)

    @property
    def fitted(self) -> int:
        """Number of drops in the joint fit of `analysis`; 0 without a joint fit."""
        return sum(result.learned for result in self.analysis.drops)

    @property
    def pace_s(self) -> float | None:
        """Median time between drops, s; `None` before the third."""
        at = [entry.host_ns for entry in self.states if entry.state is RunState.RECORDED]
        gaps = [(b - a) * 1e-9 for a, b in itertools.pairwise(at) if b > a]
        return median(gaps) if len(gaps) > 1 else None

    @property
    def channels(self) -> tuple[int, ...]:
        """Channels of the scene's gates."""
        return tuple(gate.channel for gate in self.protocol.gates.gates)


def _scene(session: Reader) -> _Scene:
    protocol = protocol_of(session)
    return _Scene(protocol, plan_of(protocol), model_curves(protocol), kept_back(session))


@dataclass(slots=True)
class LiveAnalysis:
    """Reads a session repeatedly, and analyses new drops.

    Parameters
    ----------
    path
        The session file.
    """

    path: Path
    _summaries: dict[Job, DropSummary] = field(default_factory=dict)
    _states: Sequence[StateEntry] | None = None
    _drops: dict[Job, Drop] = field(default_factory=dict)
    _joint_fit: tuple[object, Analysis | None] = (None, None)
    """The latest joint fit, and its drops with their verdicts and time scales."""
    _calibrator: Calibrator = field(default_factory=Calibrator)
    _replay: ByteReplay = field(default_factory=ByteReplay)
    _readings: int = 0
    _lock: Lock = field(default_factory=Lock)

    @property
    def done(self) -> int:
        """Number of drops analysed so far, to show progress of the first reading."""
        return len(self._summaries)

    def clock(self, session: Reader) -> Calibration:
        """Return the calibration of the session's clock from all records so far."""
        return self._calibrator.look(session, protocol_of(session).reference_u)

    def judge(self, session: Reader, drop: Drop) -> DropResult:
        """Return a drop's own result, as `read` does.

        Parameters
        ----------
        session
            The open session.
        drop
            A drop recorded in it.
        """
        scene = _scene(session)
        result = self._summary(scene, drop, self.clock(session).scale(drop)).result
        return veiled_drop(result) if scene.blind else result

    def read(self) -> SessionView:
        """Return the session as it is now; safe in any thread, and serialized.

        Raises
        ------
        SessionError
            The file cannot be read.
        """
        with self._lock, Session.open(self.path, readonly=True) as session:
            with session.snapshot():
                scene, clock, digest = _scene(session), self.clock(session), None
                states = tuple(session.states())
                if states != self._states:  # records are only added, each with a log entry
                    self._drops = {drop.job: drop for drop in session.drops(self._replay)}
                    self._states, digest = states, session.digest()
            drops, causes = self._drops, rejected_drops(states)
            scales = {job: clock.scale(drop) for job, drop in drops.items()}
            results = {
                job: overrule(self._summary(scene, drop, scales[job]).result, causes)
                for job, drop in drops.items()
            }
            enough = sum(result.verdict in GOOD for result in results.values()) >= FEWEST
            members = self._members(results)
            # Look for a stored analysis of these records; that of a blind session has no values.
            if digest and enough and not scene.blind and self._joint_fit[0] != members:
                finished = find(SessionResults, digest)
                if finished is not None:
                    self._joint_fit = members, finished.analysis
            self._readings += 1
            of, joint = self._joint_fit if enough else (None, None)
            view = SessionView(
                **vars(scene),
                path=self.path,
                reading=self._readings,
                simulated=session.simulated,
                drops=drops,
                results=results,
                scales=scales,
                analysis=joint or sum_up(scene.protocol, results.values()),
                lagging=enough and of != members,
                clock=clock,
                states=states,
            )
            return _veiled_view(view) if scene.blind else view

    def fit_jointly(self, view: SessionView) -> None:
        """Fit all drops together, as ``rig analyze`` does, for the next `read`.

        Slow; safe in any thread beside `read`.

        Parameters
        ----------
        view
            Result of `read`.
        """
        own, protocol = self._summaries, view.protocol
        drops = (
            (drop_case(protocol, drop, own[job].scale), own[job])
            for job, drop in view.drops.items()
        )
        analysis = gather(protocol, drops, rejected_drops(view.states))
        self._joint_fit = self._members(view.results), analysis

    def _members(self, results: Mapping[Job, DropResult]) -> object:
        return {job: (drop.verdict, self._summaries[job].scale.hz) for job, drop in results.items()}

    def _summary(self, scene: _Scene, drop: Drop, scale: TimeScale) -> DropSummary:
        """Return a drop's own summary, from memory, the cache or a new analysis."""
        summary = self._summaries.get(drop.job) or scene.kept.get(drop)
        if summary is None or abs(summary.scale.hz / scale.hz - 1.0) > _SAME_SCALE:
            case = drop_case(scene.protocol, drop, scale)
            summary = scene.kept[drop] = case.summary(summary)
        self._summaries[drop.job] = summary
        return summary


def _veiled_view(view: SessionView) -> SessionView:
    """Return a view without measured values, and without edges that would reveal them."""
    drops = {job: replace(drop, edges=()) for job, drop in view.drops.items()}
    results = {job: veiled_drop(result) for job, result in view.results.items()}
    analysis = veil(view.analysis)
    return replace(view, drops=drops, results=results, analysis=analysis, lagging=False)
