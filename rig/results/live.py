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
from rig.analysis.drop import fit_drop
from rig.analysis.gravity import free_gravity
from rig.analysis.joint_fit import FEWEST
from rig.analysis.result import GOOD
from rig.analysis.session import gather, overruled, planned_run, sum_up
from rig.clock.calibration import Calibrator
from rig.protocol.plan import runs as planned_runs
from rig.records import Job
from rig.results.blind import kept_back, veiled, veiled_drop
from rig.results.known_drops import KnownDrops
from rig.results.whole import protocol_of, rejected
from rig.session.drop_check import ByteReplay
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from rig.analysis.fit import Fit
    from rig.analysis.result import DropResult, Measured
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
    gravity
        What each good drop's free chain says of gravity, m/s².
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
    gravity: Mapping[Job, Measured]
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
    """What is planned, and what is known of drops; `complete` once the timer's beams are known."""

    protocol: Protocol
    plan: dict[int, Run]
    known: KnownDrops
    complete: bool

    def fit(self, drop: Drop, scale: TimeScale) -> tuple[DropResult, Fit | None]:
        """Fit one drop by itself."""
        run = planned_run(self.plan, drop)
        return fit_drop(self.protocol, run, drop, scale, known=self.known)


class _Analysed(NamedTuple):
    """One drop by itself, at a tick rate."""

    hz: float
    result: DropResult
    fit: Fit | None
    gravity: Measured | None


class _JointFit(NamedTuple):
    """What drops say fitted together, `size` of them; `of` is who was there, and how."""

    of: object
    size: int
    analysis: Analysis


@dataclass(slots=True)
class LiveAnalysis:
    """Reads one session again and again, and analyses what is new.

    Parameters
    ----------
    path
        The session file.
    """

    path: Path
    done: int = 0
    """Drops that were read and analysed, for who waits for the first reading."""
    _known: dict[Job, _Analysed] = field(default_factory=dict)
    _log: Sequence[StateEntry] | None = None
    _drops: dict[Job, Drop] = field(default_factory=dict)
    _curves: dict[str, Any] | None = None
    _joint_fit: _JointFit | None = None
    _calibrator: Calibrator = field(default_factory=Calibrator)
    _replay: ByteReplay = field(default_factory=ByteReplay)
    _scene: _Scene | None = None
    _readings: int = 0
    _lock: Lock = field(default_factory=Lock)

    @property
    def known(self) -> KnownDrops | None:
        """Which rods the edges of its drops are; `None` before it was asked for any."""
        return None if self._scene is None else self._scene.known

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
        scene = self._planned(session)
        result, _ = scene.fit(drop, self.clock(session).scale(drop))
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
                if states != self._log:  # records are only added, and that is logged
                    checked = session.drops(self._replay)
                    self._drops = {Job(drop.run, drop.attempt): drop for drop in checked}
                    self._log = states
                causes, blind = rejected(session), kept_back(session, protocol)
            drops = self._drops
            scales = {job: clock.scale(drop) for job, drop in drops.items()}
            for job, drop in drops.items():
                self._analyse(scene, job, drop, scales[job])
            results = {job: overruled(self._known[job].result, causes.get(job)) for job in drops}
            if self._curves is None:
                self._curves = model_curves(protocol)
            self._readings += 1
            enough = sum(result.verdict in GOOD for result in results.values()) >= FEWEST
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
                gravity={job: g for job in drops if (g := self._known[job].gravity) is not None},
                analysis=joint.analysis if joint else sum_up(protocol, results.values()),
                fitted=joint.size if joint else 0,
                lagging=enough and (joint is None or joint.of != self._members(results)),
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
        of = self._members(view.results)
        fits = [self._fit(view, job) for job in view.results]
        found = gather(view.protocol, list(view.results.values()), fits)
        size = sum(result.learned for result in (*found.runs, *found.superseded))
        self._joint_fit = _JointFit(of, size, found)

    def _fit(self, view: SessionView, job: Job) -> Fit | None:
        known = self._known[job]
        if known.fit is None and known.result.verdict in GOOD:
            assert self._scene is not None
            _, fit = self._scene.fit(view.drops[job], view.scales[job])
            self._known[job] = known = known._replace(fit=fit)
        return known.fit

    def _members(self, results: Mapping[Job, DropResult]) -> object:
        return {job: (result.verdict, self._known[job].hz) for job, result in results.items()}

    def _planned(self, session: Reader) -> _Scene:
        scene = self._scene
        if scene is None or not scene.complete:
            protocol = protocol_of(session)
            if scene is None or scene.protocol != protocol:
                plan = {run.number: run for run in planned_runs(protocol)}
                known = KnownDrops(protocol, blind=kept_back(session, protocol))
                scene = _Scene(protocol, plan, known, complete=False)
            self._scene = scene = scene._replace(complete=bool(session.identities()))
        return scene

    def _analyse(self, scene: _Scene, job: Job, drop: Drop, scale: TimeScale) -> None:
        analysed = self._known.get(job)
        if analysed is None or abs(analysed.hz / scale.hz - 1.0) > _SAME_SCALE:
            result, fit = scene.fit(drop, scale)
            protocol = scene.protocol
            falls = result.verdict in GOOD and protocol.drag is None and protocol.track is None
            gravity = free_gravity(protocol, result, drop, scale) if falls else None
            self._known[job] = _Analysed(scale.hz, result, fit, gravity)
        self.done = len(self._known)


def _veiled_view(view: SessionView) -> SessionView:
    """Leave out what was measured, and the edges from which it could be drawn."""
    drops = {job: replace(drop, edges=()) for job, drop in view.drops.items()}
    results = {job: veiled_drop(result) for job, result in view.results.items()}
    told = veiled(view.analysis)
    return replace(
        view, drops=drops, results=results, analysis=told, gravity={}, fitted=0, lagging=False
    )


def _pace(states: Sequence[StateEntry]) -> float | None:
    at = [entry.host_ns for entry in states if entry.state is RunState.RECORDED]
    gaps = [(b - a) * 1e-9 for a, b in itertools.pairwise(at) if b > a]
    return median(gaps) if len(gaps) > 1 else None
