"""What the session file says, as the screens need it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.tui.state import RunLine, State

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from rig.analysis.drop import TimeScale
    from rig.analysis.result import DropResult, Measured
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop
    from rig.results import Calibration
    from rig.session.reading import StateEntry
    from rig.tui.plan import Job


@dataclass(frozen=True, slots=True)
class Findings:
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
        What ``rig analyze --json`` prints: of the drops that `learned` is about, or, before
        anything was learned, of all of them by themselves.
    learned
        How many drops taught each other in `analysis`; 0 for none.
    lagging
        Whether the drops could teach more than is in `analysis`.
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
    gravity: Mapping[Job, Measured]
    analysis: Mapping[str, Any]
    learned: int
    lagging: bool
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


def good(record: Mapping[str, Any]) -> bool:
    """Whether a run takes part in the summary."""
    return record.get("verdict") in GOOD
