"""A session file as it stands, with everything that follows from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from rig.analysis.result import DropResult, Measured
    from rig.clock.calibration import Calibration, TimeScale
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop, Job
    from rig.session.reading import StateEntry


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
        What ``rig analyze --json`` prints: of the drops that `fitted` counts, or, before there is
        a joint fit, of all of them by themselves.
    fitted
        How many drops were fitted jointly in `analysis`; 0 for none.
    lagging
        Whether a joint fit would say more than is in `analysis`.
    curves
        The model against inclination, as `rig.analysis.curves.model_curves` gives it.
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
    fitted: int
    lagging: bool
    curves: Mapping[str, Any]
    clock: Calibration
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

    def record(self, job: Job) -> Mapping[str, Any]:
        """One attempt's result as `rig analyze --json` prints it; empty when not analysed."""
        result = self.results.get(job)
        return {} if result is None else result.json()


def good(record: Mapping[str, Any]) -> bool:
    """Whether a run takes part in the summary."""
    return record.get("verdict") in GOOD
