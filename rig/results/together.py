"""Joint results of several sessions, and differences between them.

Each session counts once; it must be finished, undamaged, unblinded and of the same kind of scene.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

from rig.analysis.averages import combine
from rig.analysis.plain_data import Record, attributes, plain
from rig.analysis.result import GOOD, DropResult, Measured
from rig.analysis.session import Analysis, Progress
from rig.analysis.several import SessionPart, fit_parts, pool_means, same_owners
from rig.analysis.summary import Incline, good_cases
from rig.measurands import averaged
from rig.protocol.plan import runs as planned_runs
from rig.protocol.protocol import Condition
from rig.reasons import rig_error
from rig.results.whole import SessionResults, check_open, complete_analysis, protocol_of, results
from rig.session.reading import Reader


@dataclass(frozen=True, slots=True)
class MeanDifference(Record):
    """A session's mean less that of the reference, which is the first session.

    Attributes
    ----------
    quantity
        JSON name of the measurand.
    session, reference
        Names of the sessions.
    condition
        Condition of the session's runs.
    value
        The difference with its uncertainty.
    """

    MEMBERS = (
        "session reference *condition quantity *value "
        "normalized_error=value.normalized_error budget=value.budget"
    )

    quantity: str
    session: str
    reference: str
    condition: Condition
    value: Measured


@dataclass(frozen=True, slots=True)
class TogetherResults:
    """Results of several sessions.

    Attributes
    ----------
    sessions
        Each session's own results, by name, in the order given.
    parts
        The sessions with their analysis from the joint fit of all.
    shared
        Names of the sessions that share the owner of the key, a list for each rig.
    pooled
        Means over all sessions of a scene, by their names.
    """

    sessions: Mapping[str, SessionResults]
    parts: tuple[SessionPart, ...]
    shared: Mapping[str, Sequence[Sequence[str]]]
    pooled: Mapping[tuple[str, ...], Sequence[Incline]]

    @property
    def simulated(self) -> bool:
        """Whether any of the sessions is simulated."""
        return any(session.simulated for session in self.sessions.values())

    @property
    def summary(self) -> tuple[Incline, ...]:
        """Means over the runs of all sessions of a scene."""
        return tuple(line for summary in self.pooled.values() for line in summary)

    def analyses(self) -> list[tuple[str, Analysis]]:
        """Return the analysis of each session from the joint fit, by name."""
        return [(part.name, part.analysis) for part in self.parts]

    @property
    def void(self) -> bool:
        """Whether any run is void."""
        return any(run.verdict == "void" for _, item in self.analyses() for run in item.runs)

    def json(self) -> dict[str, Any]:
        """Return the object that ``rig analyze A B --json`` prints."""
        rig = self.parts[0].analysis.rig
        return {
            "simulated": self.simulated,
            "sessions": [
                {"session": name} | attributes(session, "simulated", "calibration")
                for name, session in self.sessions.items()
            ],
            **self._shared_json(),
            "runs": self._members("runs"),
            "summary": [
                {"sessions": list(names), **line.json()}
                for names, summary in self.pooled.items()
                for line in summary
            ],
            **({} if rig is None else attributes(rig, "learned")),
        }

    def comparison_json(self) -> dict[str, Any]:
        """Return the object that ``rig compare --json`` prints."""
        head = {"simulated": self.simulated, **self._shared_json()}
        return head | {"means": self._members("summary"), "differences": plain(self.differences())}

    def _shared_json(self) -> dict[str, Any]:
        shared = self.shared.items()
        return {"shared": [{"what": owner, "sessions": plain(groups)} for owner, groups in shared]}

    def _members(self, name: Literal["runs", "summary"]) -> list[dict[str, Any]]:
        """Return runs or means of all sessions as JSON data, each with its session."""
        return [
            {"session": session, **member.json()}
            for session, analysis in self.analyses()
            for member in getattr(analysis, name)
        ]

    def differences(self) -> list[MeanDifference]:
        """Return each session's means less those of the first, for conditions of both.

        Chains may have different names: if no striking chain has the same name, a single mean at
        the same incline is used.

        Raises
        ------
        InputError
            No session has runs like those of the first.
        """
        first, *rest = self.parts
        reference = _cases(first)
        differences = []
        for part in rest:
            for condition, runs in _cases(part).items():
                alike = [key for key in reference if key.incline_deg == condition.incline_deg]
                same = [key for key in alike if key.impact_chain == condition.impact_chain] or alike
                pair = runs, reference[same[0]] if len(same) == 1 else []
                for row in averaged() if pair[1] else ():
                    if all(row.name in run.quantities for member in pair for run in member):
                        values = [[run.quantities[row.name] for run in member] for member in pair]
                        names = row.name, part.name, first.name
                        difference = combine(values, (1.0, -1.0))
                        differences.append(MeanDifference(*names, condition, difference))
        if not differences:
            raise rig_error("nothing_to_compare", path=first.name)
        return differences


def _cases(part: SessionPart) -> dict[Condition, list[DropResult]]:
    """Return the good runs of a session, by condition."""
    cases = good_cases(part.protocol, part.analysis.runs)
    return {part.protocol.condition(runs[0].run): runs for runs in cases}


def results_together(
    files: Sequence[Reader],
    *,
    same_rig: bool | None = None,
    unfinished: bool = False,
    fresh: bool = False,
    progress: Progress | None = None,
) -> TogetherResults:
    """Analyse several sessions in one joint fit.

    Parameters
    ----------
    files
        Open sessions.
    same_rig
        See `rig.analysis.several.same_owners`.
    unfinished
        Whether planned runs may be missing.
    fresh, progress
        As for `rig.results.whole.results`, for each session in turn.

    Raises
    ------
    InputError, SessionError
        A session cannot be added to the others.
    """
    parts: list[SessionPart] = []
    own: list[SessionResults] = []
    for name, session in zip(_names(files), files, strict=True):
        protocol, path = protocol_of(session), str(session.path)
        check_open(session)
        outcome = results(session, progress, fresh=fresh)
        planned = len(planned_runs(protocol))
        _check_whole(path, outcome.analysis, planned, unfinished=unfinished)
        analysis = complete_analysis(session, outcome, progress)
        boards = [identity.get("unique_id", "") for _, identity in session.identities()]
        parts.append(SessionPart(name, protocol, analysis, str(boards[-1] if boards else "")))
        own.append(outcome)
    _check_repeats(files, own)
    shared = same_owners(parts, same_rig=same_rig)
    fitted = fit_parts(parts, shared)
    sessions = {part.name: outcome for part, outcome in zip(parts, own, strict=True)}
    return TogetherResults(sessions, fitted, shared, pool_means(fitted))


def _names(files: Sequence[Reader]) -> list[str]:
    """Return session names: file names, or full paths if file names are not unique."""
    names = [session.path.name for session in files]
    return names if len(set(names)) == len(names) else [str(session.path) for session in files]


def _check_repeats(files: Sequence[Reader], own: Sequence[SessionResults]) -> None:
    """Raise an error if drops would count twice: the same session, its copy or continuation."""
    recorded = [(str(file.path), {*part.edges}) for file, part in zip(files, own, strict=True)]
    for (path, edges), (other_path, rest) in combinations(recorded, 2):
        common = len(edges & rest)
        # With few edges and a coarse timer, single drops may be equal by chance.
        if common and common == min(len(edges), len(rest)):
            values = {"path": other_path, "other": path, "drops": common}
            raise rig_error("session_repeated", **values)


def _check_whole(path: str, analysis: Analysis, planned: int, *, unfinished: bool) -> None:
    """Raise an error for a session that is damaged, or lacks runs."""
    if analysis.damaged:
        records = "; ".join(analysis.damage)
        raise rig_error("records_damaged", path=path, records=records)
    missing = planned - len(analysis.runs)
    if missing and not unfinished:
        counts = {"missing": missing, "planned": planned}
        raise rig_error("session_unfinished", path=path, **counts)
    if not any(run.verdict in GOOD for run in analysis.runs):
        raise rig_error("session_no_results", path=path)
