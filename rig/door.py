"""The Python door: a session's results and edges, and predictions, for scripts and notebooks.

>>> import rig
>>> session = rig.open("my.session")
>>> found = session.analyze()
>>> found.runs[0].separation.value
>>> print(found)

Values are in SI units, angles in degrees. A session is opened for reading; nothing here writes.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.analysis.result import GOOD, DropResult, Measured, optional_package
from rig.analysis.summary import Incline
from rig.bundle.tables import column_unit, result_tables
from rig.errors import InputError
from rig.measurands import MEASURANDS
from rig.model.prediction import PredictedIncline
from rig.predictions import predictions
from rig.protocol import reader
from rig.protocol.protocol import Protocol
from rig.ready import find_protocol
from rig.reasons import rig_error
from rig.report.numbers import ranges, with_unit
from rig.report.parts import means_parts, summary_table
from rig.report.templates import parts_html
from rig.results.together import MeanDifference, TogetherResults, results_together
from rig.results.whole import SessionResults, calibration, protocol_of, results
from rig.session.store import Session


def open(path: str | os.PathLike[str]) -> RecordedSession:  # noqa: A001 - it is rig.open
    """Open a session for reading.

    Parameters
    ----------
    path
        The session file, as `rig run` or `rig import` made it. It may still be growing.

    Raises
    ------
    SessionError
        If there is no such session, or it cannot be read.
    """
    return RecordedSession(Session.open(path, readonly=True))


def read_protocol(path: str | os.PathLike[str]) -> Protocol:
    """Read a protocol file.

    Raises
    ------
    InputError
        With every problem at its line and column.
    """
    return reader.read(find_protocol(str(path)))


def predict(protocol: Protocol) -> list[PredictedIncline]:
    """Predict each incline of a protocol's plan by the discrete model (Eqs. 8 to 13).

    Returns
    -------
    list of PredictedIncline
        One an incline; of unlike chains one for each that strikes.
    """
    return predictions(protocol)


class Edges(NamedTuple):
    """The edges of one drop, in the order in which they came; shape ``(edges,)`` each.

    Attributes
    ----------
    time_s
        Since the release was fired, by the calibrated clock.
    channel
        Of the gate.
    blocked
        Whether the beam is dark from then on.
    """

    time_s: NDArray[np.float64]
    channel: NDArray[np.int64]
    blocked: NDArray[np.bool_]


class RecordedSession(AbstractContextManager["RecordedSession"]):
    """A session, open for reading; also a context manager."""

    def __init__(self, file: Session) -> None:
        self._file = file

    @property
    def simulated(self) -> bool:
        """Whether no chain ever fell."""
        return self._file.simulated

    @property
    def protocol(self) -> Protocol:
        """What was planned, as the session keeps it."""
        return protocol_of(self._file)

    def analyze(
        self, progress: Callable[[int, int], None] | None = None, *, fresh: bool = False
    ) -> Results:
        """Compute everything from the raw edges, as `rig analyze` does, or return what is kept.

        Parameters
        ----------
        progress
            Called with the number of drops done and the number of all.
        fresh
            Whether to compute it in any case.
        """
        return Results(results(self._file, progress, fresh=fresh))

    def edges(self, run: int, attempt: int | None = None) -> Edges:
        """Return the recorded edges of a run, by default of its latest attempt.

        Raises
        ------
        InputError
            If no such drop was recorded.
        SessionError
            If its stored record is damaged.
        """
        recorded = [*self._file.drops()]
        drops = [drop for drop in recorded if drop.run == run and attempt in {None, drop.attempt}]
        if not drops:
            runs = ranges("run", [drop.run for drop in recorded])
            raise rig_error("run_unrecorded", path=self._file.path, run=run, runs=runs)
        drop = drops[-1]
        if drop.damage:
            raise rig_error("drop_damaged", drop=str(drop.job), text=drop.damage)
        ticks, channels, blocked = np.array(drop.edges, np.int64).reshape(-1, 3).T
        return Edges(ticks / calibration(self._file).scale(drop).hz, channels, blocked != 0)

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    def __add__(self, other: RecordedSession) -> RecordedSessions:
        """Return both sessions as one."""
        return RecordedSessions((self, other))

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        stamp = ", simulated" if self.simulated else ""
        return f"<session {self._file.path.name}: {len(self._file.latest_drops())} runs{stamp}>"


@dataclass(frozen=True, slots=True)
class RecordedSessions:
    """Several sessions as one, as the sum of open sessions makes them.

    Attributes
    ----------
    sessions
        In the order of the sum; differences are from the first.
    """

    sessions: tuple[RecordedSession, ...]

    def __add__(self, other: RecordedSession) -> RecordedSessions:
        """Return these sessions and one more."""
        return RecordedSessions((*self.sessions, other))

    def analyze(self, *, same_rig: bool | None = None, unfinished: bool = False) -> Results:
        """Compute everything in one joint fit, as `rig analyze A B` does.

        Parameters
        ----------
        same_rig
            Whether all have the same posts, gates and chains; if `None`, those with the same title
            and board, as far as their protocols agree.
        unfinished
            Whether planned runs may be missing.

        Raises
        ------
        InputError, SessionError
            A session cannot be added to the others.
        """
        return Results(self._together(same_rig, unfinished))

    def compare(
        self, *, same_rig: bool | None = None, unfinished: bool = False
    ) -> list[MeanDifference]:
        """Return each mean less that of the first session; parameters as for `analyze`."""
        return self._together(same_rig, unfinished).differences()

    def _together(self, same_rig: bool | None, unfinished: bool) -> TogetherResults:
        files = [session._file for session in self.sessions]
        return results_together(files, same_rig=same_rig, unfinished=unfinished)


class _Quantity:
    """An attribute of what has quantities: the one of this name."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, holder: _Quantities, _: type | None = None) -> Measured:
        if self._name not in holder.quantities:
            has = ", ".join(holder.quantities) or "no quantities"
            raise InputError(f"{holder!r} has no {MEASURANDS[self._name].label}", f"it has {has}")
        return holder.quantities[self._name]


class _Quantities:
    """Measured quantities by name; those of the project have attributes of their own."""

    separation = _Quantity("separation_m")
    """Δz at level, corrected to simultaneous release, m."""
    speed = _Quantity("speed_m_s")
    """V of the impact chain's top rod, m/s."""
    gravity = _Quantity("gravity_m_s2")
    """Acceleration of a chain that strikes nothing, m/s²."""
    acceleration = _Quantity("acceleration_m_s2")
    """Acceleration of one object down its track, m/s²."""

    def __init__(self, quantities: Mapping[str, Measured]) -> None:
        self.quantities = quantities

    def _written(self) -> str:
        rows = ((MEASURANDS[name], value) for name, value in self.quantities.items())
        parts = (f"{row.symbol} {with_unit(x, row)}" for row, x in rows if "told" in row.kinds)
        return ", ".join(parts)


class RunResult(_Quantities):
    """One drop.

    Attributes
    ----------
    quantities
        By JSON name, with value, u, `expanded` (95 %), degrees of freedom and budget.
    run, attempt, incline_deg, impact_chain, setting
        Which it was.
    verdict, reasons
        ``accepted``, ``marginal``, ``void`` or ``rejected``, and why.
    gates
        How one object passed each gate; empty for chains.
    session
        Name of the session, where there are several.
    """

    separation_raw = _Quantity("separation_raw_m")
    """Δz as it happened, m."""
    release_skew = _Quantity("release_skew_s")
    """The free chain's release less the impact chain's, s."""
    fall_time = _Quantity("fall_time_s")
    """From the impact chain's release to its top rod's strike, s."""

    def __init__(self, drop: DropResult, session: str) -> None:
        super().__init__(drop.quantities)
        self.run = drop.run.number
        self.attempt = drop.attempt
        self.incline_deg = drop.run.incline_deg
        self.impact_chain = drop.run.impact
        self.setting = drop.run.setting
        self.verdict: str = drop.verdict
        self.reasons = tuple(reason.text for reason in drop.reasons)
        self.gates = drop.gates
        self.session = session

    def __repr__(self) -> str:
        strikes = self.impact_chain and f"{self.incline_deg:g}°, {self.impact_chain} strikes"
        at = "".join(f" at {words}" for words in (strikes, self.setting) if words)
        values = f": {self._written()}" if self.quantities else ""
        return f"<run {self.run}{at}, {self.verdict}{values}>"


class MeanResult(_Quantities):
    """The mean of all good runs at one incline, or of one of two unlike chains there.

    Attributes
    ----------
    quantities
        Means by JSON name.
    incline_deg, impact_chain, setting, n
        What it is of, and how many runs.
    predicted
        What the model says, with its u; nothing outside its domain.
    """

    def __init__(self, line: Incline) -> None:
        super().__init__(line.means)
        self.incline_deg, self.impact_chain, self.setting = line.condition
        self.n = line.n
        self.predicted = line.predicted

    def __repr__(self) -> str:
        at = f"{self.incline_deg:g}°{self.setting and f', {self.setting}'}"
        return f"<{at}, mean of {self.n}: {self._written()}>"


class Results:
    """What a session says, or several together.

    Attributes
    ----------
    runs
        The last attempt at each run, in order.
    summary
        Means, in order of incline.
    """

    def __init__(self, found: SessionResults | TogetherResults) -> None:
        self._found = found
        self.runs = tuple(
            RunResult(run, name) for name, part in found.analyses() for run in part.runs
        )
        self.summary = tuple(MeanResult(line) for line in found.summary)

    def json(self) -> dict[str, Any]:
        """Return what `rig analyze --json` prints."""
        return self._found.json()

    def to_frame(self, table: Literal["runs", "summary", "gates"] = "runs") -> Any:
        """Return a pandas table, with columns as in the files of `rig export`.

        Parameters
        ----------
        table
            ``runs``, a row a run; ``summary``, a row a mean; ``gates``, of one object a row for
            each gate and run.

        Returns
        -------
        pandas.DataFrame
            Its ``attrs`` have ``units``, by column, and ``simulated``.

        Raises
        ------
        InputError
            Where pandas is not installed.
        """
        pd = optional_package("pandas")
        latest = {key: value for key, value in self.json().items() if key != "superseded"}
        frame = pd.DataFrame(result_tables(latest).get(table, []))
        frame.attrs["units"] = {name: column_unit(name) for name in frame if column_unit(name)}
        frame.attrs["simulated"] = self._found.simulated
        index = [name for name in ("session", "run") if name in frame]
        return frame.set_index(index) if table == "runs" and index else frame

    def _repr_html_(self) -> str:
        """Show the summary as notebooks do."""
        stamp = "<p>SIMULATED DATA</p>" if self._found.simulated else ""
        return stamp + parts_html(means_parts(self._found.summary))

    def __str__(self) -> str:
        stamp = "SIMULATED DATA\n" if self._found.simulated else ""
        damage = [line for _, analysis in self._found.analyses() for line in analysis.damage]
        return "\n".join([stamp + summary_table(self._found.summary), *damage])

    def __repr__(self) -> str:
        good = sum(run.verdict in GOOD for run in self.runs)
        stamp = ", simulated" if self._found.simulated else ""
        return f"<results of {len(self.runs)} runs, {good} of them good{stamp}>"
