"""One session file, read again and again beside its writer, and analysed where it is new."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from statistics import median
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.analysis.curves import model_curves
from rig.analysis.drop import fit_drop
from rig.analysis.gravity import free_gravity
from rig.analysis.learn import FEWEST
from rig.analysis.result import GOOD
from rig.analysis.session import Analysis, gather
from rig.analysis.summary import summarize
from rig.calibration import Calibrator
from rig.protocol.plan import runs as planned_runs
from rig.results import protocol_of, rejected
from rig.session.schema import RunState
from rig.session.store import Session
from rig.tui.findings import Findings
from rig.tui.plan import Job

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from rig.analysis.drop import TimeScale
    from rig.analysis.fit import Fit
    from rig.analysis.result import DropResult, Measured
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop
    from rig.session.reading import StateEntry

_SAME_SCALE = 5e-6
"""Relative change of the tick rate below which a drop is not analysed again: 50 nm in 10 mm."""


class _Analysed(NamedTuple):
    """One drop by itself, at a tick rate."""

    hz: float
    result: DropResult
    fit: Fit | None
    gravity: Measured | None


class _Lesson(NamedTuple):
    """What drops said after `size` of them taught each other; `of` is who was there, and how."""

    of: object
    size: int
    analysis: Mapping[str, Any]


@dataclass(slots=True)
class Book:
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
    _lesson: _Lesson | None = None
    _calibrator: Calibrator = field(default_factory=Calibrator)
    _readings: int = 0
    _lock: Lock = field(default_factory=Lock)

    def read(self) -> Findings:
        """Read the file as it is now; safe in any thread, one at a time.

        Raises
        ------
        SessionError
            The file cannot be read.
        """
        with self._lock, Session.open(self.path, readonly=True) as session:
            protocol = protocol_of(session)
            plan = {run.number: run for run in planned_runs(protocol)}
            clock, states = self._calibrator.look(session), tuple(session.states())
            if states != self._log:  # records are never altered, only added, and that is logged
                self._drops = {Job(drop.run, drop.attempt): drop for drop in session.drops()}
                self._log = states
            drops = self._drops
            scales = {job: clock.scale(drop) for job, drop in drops.items()}
            causes = rejected(session)
            for job, drop in drops.items():
                self._analyse(protocol, plan[job.run], job, drop, scales[job])
            results = {job: _rejected(self._known[job].result, causes.get(job)) for job in drops}
            if self._curves is None:
                self._curves = model_curves(protocol)
            self._readings += 1
            enough = sum(result.verdict in GOOD for result in results.values()) >= FEWEST
            lesson = self._lesson if enough else None
            return Findings(
                path=self.path,
                reading=self._readings,
                protocol=protocol,
                simulated=session.simulated,
                created=session.meta["created"],
                plan=plan,
                drops=drops,
                results=results,
                scales=scales,
                gravity={job: g for job in drops if (g := self._known[job].gravity) is not None},
                analysis=lesson.analysis if lesson else _summed(protocol, results),
                learned=lesson.size if lesson else 0,
                lagging=enough and (lesson is None or lesson.of != self._classmates(results)),
                curves=self._curves,
                clock=clock,
                voids=frozenset(Job(e.run, e.attempt) for e in states if e.state is RunState.VOID),
                states=states,
                pace_s=_pace(states),
            )

    def learn(self, findings: Findings) -> None:
        """Let all drops teach each other, as ``rig analyze`` does; the next reading has it.

        Takes its time; safe in any thread beside `read`.

        Parameters
        ----------
        findings
            From `read`.
        """
        of = self._classmates(findings.results)
        fits = [self._known[job].fit for job in findings.results]
        found = gather(findings.protocol, list(findings.results.values()), fits)
        size = sum(result.learned for result in (*found.runs, *found.superseded))
        self._lesson = _Lesson(of, size, found.json())

    def _classmates(self, results: Mapping[Job, DropResult]) -> object:
        return {job: (result.verdict, self._known[job].hz) for job, result in results.items()}

    def _analyse(
        self, protocol: Protocol, run: Run, job: Job, drop: Drop, scale: TimeScale
    ) -> None:
        known = self._known.get(job)
        if known is None or abs(known.hz / scale.hz - 1.0) > _SAME_SCALE:
            result, fit = fit_drop(protocol, run, drop, scale)
            falls = result.verdict in GOOD and protocol.drag is None
            gravity = free_gravity(protocol, result, drop, scale) if falls else None
            self._known[job] = _Analysed(scale.hz, result, fit, gravity)
        self.done = len(self._known)


def _rejected(result: DropResult, causes: Sequence[str] | None) -> DropResult:
    if causes is None:
        return result
    return replace(result, verdict="rejected", reasons=(*causes, *result.reasons))


def _summed(protocol: Protocol, results: Mapping[Job, DropResult]) -> dict[str, Any]:
    ordered = [results[job] for job in sorted(results)]
    last = {result.run.number: result for result in ordered}
    latest = tuple(last.values())
    earlier = tuple(result for result in ordered if last[result.run.number] is not result)
    return Analysis(latest, earlier, tuple(summarize(protocol, latest))).json()


def _pace(states: Sequence[StateEntry]) -> float | None:
    at = [entry.host_ns for entry in states if entry.state is RunState.RECORDED]
    gaps = [(b - a) * 1e-9 for a, b in itertools.pairwise(at) if b > a]
    return median(gaps) if len(gaps) > 1 else None
