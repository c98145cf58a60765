"""What the session file says, read beside its writer and analysed drop by drop."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from statistics import median
from threading import Lock
from typing import TYPE_CHECKING, Any

from rig.analysis.curves import model_curves
from rig.analysis.drop import analyze_drop
from rig.analysis.result import GOOD
from rig.analysis.session import Analysis
from rig.analysis.summary import summarize
from rig.protocol.plan import runs as planned_runs
from rig.results import calibration, protocol_of, rejected
from rig.session.schema import RunState
from rig.session.store import Session
from rig.tui.plan import Job
from rig.tui.state import RunLine, State

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from rig.analysis.drop import TimeScale
    from rig.analysis.result import DropResult
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop
    from rig.results import Calibration
    from rig.session.reading import StateEntry

_SAME_SCALE = 5e-6
"""Relative change of the tick rate below which a drop is not analysed again: 50 nm in 10 mm."""


@dataclass(frozen=True, slots=True)
class Findings:
    """A session as it stands on the disk.

    Attributes
    ----------
    reading
        Which reading of the file this is: what is drawn from it changes with it.
    drops, results
        Every recorded attempt, and what it says.
    analysis
        What ``rig analyze --json`` prints of it.
    curves
        The model against inclination, as `rig.analysis.curves.model_curves` gives it.
    voids
        Attempts that were void.
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
    analysis: Mapping[str, Any]
    curves: Mapping[str, Any]
    clock: Calibration
    voids: frozenset[Job]
    states: tuple[StateEntry, ...]
    pace_s: float | None

    @property
    def jobs(self) -> tuple[Job, ...]:
        """Every recorded attempt, in order of recording."""
        return tuple(self.drops)

    @property
    def channels(self) -> tuple[int, ...]:
        """Channels of the scene's gates."""
        gates = self.protocol.gates
        return () if gates is None else tuple(gate.channel for gate in gates.gates)

    def state(self) -> State:
        """What a daemon would say of this file that nobody is writing."""
        last = {entry.run: entry for entry in self.states}
        runs = []
        for run in self.plan.values():
            entry = last.get(run.number)
            line = RunLine(run.number, run.incline_deg, run.impact, run.free)
            if entry is not None:
                line = line._replace(
                    attempt=entry.attempt, state=str(entry.state), reasons=entry.reasons
                )
            runs.append(line)
        session = {"path": str(self.path), "title": self.protocol.title}
        return State(0, {"session": session | {"simulated": self.simulated}}, tuple(runs))

    def record(self, job: Job) -> Mapping[str, Any]:
        """One attempt's result as `rig analyze --json` prints it; empty when not analysed."""
        result = self.results.get(job)
        return {} if result is None else result.json()


@dataclass(slots=True)
class Book:
    """Reads one session again and again, and analyses what is new.

    Parameters
    ----------
    path
        The session file.
    """

    path: Path
    _results: dict[Job, tuple[float, DropResult]] = field(default_factory=dict)
    _curves: dict[str, Any] | None = None
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
            clock = calibration(session)
            drops = {Job(drop.run, drop.attempt): drop for drop in session.drops()}
            scales = {job: clock.scale(drop) for job, drop in drops.items()}
            causes = rejected(session)
            for job, drop in drops.items():
                self._analyse(protocol, plan[job.run], job, drop, scales[job])
            results = {job: _rejected(self._results[job][1], causes.get(job)) for job in drops}
            states = tuple(session.states())
            if self._curves is None:
                self._curves = model_curves(protocol)
            self._readings += 1
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
                analysis=_summed(protocol, results),
                curves=self._curves,
                clock=clock,
                voids=frozenset(Job(e.run, e.attempt) for e in states if e.state is RunState.VOID),
                states=states,
                pace_s=_pace(states),
            )

    def _analyse(
        self, protocol: Protocol, run: Run, job: Job, drop: Drop, scale: TimeScale
    ) -> None:
        known = self._results.get(job)
        if known is None or abs(known[0] / scale.hz - 1.0) > _SAME_SCALE:
            self._results[job] = scale.hz, analyze_drop(protocol, run, drop, scale)


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


def good(record: Mapping[str, Any]) -> bool:
    """Whether a run takes part in the summary."""
    return record.get("verdict") in GOOD
