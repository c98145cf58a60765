"""Where each planned run stands by the log of a session: for a plan, the daemon and its clients."""

from collections.abc import Iterable, Mapping
from dataclasses import astuple
from typing import Any, NamedTuple

from rig.protocol.protocol import Run
from rig.reasons import Reason, read_record, reasons_json
from rig.records import Job
from rig.session.reading import StateEntry


class RunLine(NamedTuple):
    """Where one planned run stands."""

    run: int
    incline_deg: float
    impact: str | None
    free: str | None
    setting: str = ""
    attempt: int = 0
    state: str = "planned"
    reasons: tuple[Reason, ...] = ()

    @property
    def again(self) -> Job:
        """Another attempt, whatever became of the latest one."""
        return Job(self.run, self.attempt + 1)

    def json(self) -> dict[str, Any]:
        """Return it as the state's section ``runs`` has it; `read_line` takes it back."""
        return self._asdict() | reasons_json(self.reasons, Reason.record)


def read_line(line: Mapping[str, Any]) -> RunLine:
    """Take a run from a daemon's state."""
    fields = {name: line[name] for name in RunLine._fields if name in line}
    return RunLine(**fields | {"reasons": tuple(map(read_record, line["reason_codes"]))})


def plan_lines(planned: Iterable[Run], log: Iterable[StateEntry]) -> list[RunLine]:
    """Say where each planned run stands by the log of a session."""
    last = {entry.run: (entry.attempt, entry.state, entry.reasons) for entry in log}
    return [RunLine(*astuple(run), *last.get(run.number, ())) for run in planned]
