"""Several sessions as one: their results in one joint fit, and what they differ by.

Each session counts once, and is finished, undamaged, unblinded and of the same kind of scene.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

from rig.analysis.averages import difference
from rig.analysis.plain_data import attributes
from rig.analysis.result import GOOD
from rig.analysis.several import SessionPart, fit_sessions
from rig.analysis.summary import good_cases
from rig.errors import InputError
from rig.measurands import averaged
from rig.protocol.plan import runs as planned_runs
from rig.reasons import make_error
from rig.results.blind import check_open
from rig.results.whole import complete_analysis, protocol_of, results

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rig.analysis.result import DropResult, Measured
    from rig.analysis.session import Analysis, Progress
    from rig.analysis.several import SessionsFit
    from rig.analysis.summary import Incline
    from rig.protocol.protocol import Condition
    from rig.results.whole import SessionResults
    from rig.session.reading import Reader

    Runs = Sequence[DropResult]


@dataclass(frozen=True, slots=True)
class MeanDifference:
    """A session's mean less that of the reference, the first of the sessions.

    Attributes
    ----------
    quantity
        JSON name of the measurand.
    session, reference
        Names of the sessions.
    condition
        Of the session's runs.
    value
        Of the difference, with its uncertainty.
    """

    quantity: str
    session: str
    reference: str
    condition: Condition
    value: Measured

    def json(self) -> dict[str, Any]:
        """One member of ``differences``."""
        sessions = attributes(self, "session", "reference")
        value = self.value.json() | attributes(self.value, "normalized_error", "budget")
        return sessions | self.condition.json() | {"quantity": self.quantity} | value


@dataclass(frozen=True, slots=True)
class TogetherResults:
    """All that follows from several sessions.

    Attributes
    ----------
    sessions
        What each says by itself, by name, in the order given.
    fit
        Of all.
    """

    sessions: Mapping[str, SessionResults]
    fit: SessionsFit

    @property
    def simulated(self) -> bool:
        """Whether any of the sessions is simulated."""
        return any(session.simulated for session in self.sessions.values())

    @property
    def summary(self) -> tuple[Incline, ...]:
        """Means over the runs of all sessions of a scene."""
        return tuple(line for scene in self.fit.pooled for line in scene.summary)

    def analyses(self) -> list[tuple[str, Analysis]]:
        """Return the analysis of each session, in the light of all, by its name."""
        return [(part.name, part.analysis) for part in self.fit.parts]

    @property
    def void(self) -> bool:
        """Whether any run is void."""
        return any(run.verdict == "void" for _, item in self.analyses() for run in item.runs)

    def json(self) -> dict[str, Any]:
        """As ``rig analyze A B --json`` prints it."""
        joint = self.fit.joint
        return {
            "simulated": self.simulated,
            "sessions": [
                {"session": name, "simulated": item.simulated, "calibration": item.calibration}
                for name, item in self.sessions.items()
            ],
            "shared": self._shared(),
            "runs": [
                {"session": name, **run.json()}
                for name, analysis in self.analyses()
                for run in analysis.runs
            ],
            "summary": [
                {"sessions": list(scene.sessions), **line.json()}
                for scene in self.fit.pooled
                for line in scene.summary
            ],
            **({} if joint is None else {"learned": joint.json()}),
        }

    def _shared(self) -> list[dict[str, Any]]:
        return [
            {"what": owner, "sessions": [list(group) for group in groups]}
            for owner, groups in self.fit.shared.items()
        ]

    def comparison_json(self) -> dict[str, Any]:
        """As ``rig compare --json`` prints it."""
        return {
            "simulated": self.simulated,
            "shared": self._shared(),
            "means": [
                {"session": part.name, **line.json()}
                for part in self.fit.parts
                for line in part.analysis.summary
            ],
            "differences": [difference_row.json() for difference_row in self.differences()],
        }

    def differences(self) -> list[MeanDifference]:
        """Return each session's means less those of the first, where both have the condition.

        Chains need not have the same names: where none that strikes is alike, a single mean at the
        same incline is taken.

        Raises
        ------
        InputError
            No session has runs like those of the first.
        """
        first, *rest = self.fit.parts
        differences = [
            MeanDifference(row.name, part.name, first.name, condition, difference(*values))
            for part in rest
            for condition, *sets in _pairs(part, first)
            for row in averaged()
            if (values := [_values(runs, row.name) for runs in sets]) and all(values)
        ]
        if not differences:
            raise make_error(InputError, "nothing_to_compare", path=first.name)
        return differences


def _pairs(part: SessionPart, first: SessionPart) -> Iterator[tuple[Condition, Runs, Runs]]:
    """Yield good runs of a session with those of the first under a like condition."""
    cases, reference = (
        {member.protocol.condition(runs[0].run): runs for runs in _good_runs(member)}
        for member in (part, first)
    )
    for condition, runs in cases.items():
        alike = [key for key in reference if key.incline_deg == condition.incline_deg]
        same = [key for key in alike if key.impact_chain == condition.impact_chain] or alike
        if len(same) == 1:
            yield condition, runs, reference[same[0]]


def _good_runs(part: SessionPart) -> list[list[DropResult]]:
    return good_cases(part.protocol, part.analysis.runs)


def _values(runs: Runs, name: str) -> list[Measured]:
    """Return a measurand of runs, which all must have it: else nothing."""
    values = [run.quantities[name] for run in runs if name in run.quantities]
    return values if len(values) == len(runs) else []


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
        Open, for reading at least.
    same_rig
        See `rig.analysis.several.same_owners`.
    unfinished
        Whether planned runs may be missing.
    fresh, progress
        As for `rig.results.results`, for one session after the other.

    Raises
    ------
    InputError, SessionError
        A session cannot be added to the others.
    """
    parts, own = [], []
    for name, session in zip(_names(files), files, strict=True):
        protocol = protocol_of(session)
        check_open(session, protocol)
        session_results = results(session, progress, fresh=fresh, with_joint_fit=True)
        own.append(session_results)
        _check_whole(session, session_results, len(planned_runs(protocol)), unfinished=unfinished)
        analysis = complete_analysis(session, session_results, progress)
        boards = [identity.get("unique_id", "") for _, identity in session.identities()]
        parts.append(SessionPart(name, protocol, analysis, str(boards[-1] if boards else "")))
    _check_repeats(files, own)
    sessions = dict(zip(_names(files), own, strict=True))
    return TogetherResults(sessions, fit_sessions(parts, same_rig=same_rig))


def _names(files: Sequence[Reader]) -> list[str]:
    """Name sessions by their files, with folders where these do not tell them apart."""
    names = [session.path.name for session in files]
    return names if len(set(names)) == len(names) else [str(session.path) for session in files]


def _check_repeats(files: Sequence[Reader], part: Sequence[SessionResults]) -> None:
    """Refuse to count drops more than once: a session named twice, its copy, or that continued."""
    recorded = [
        (session.path, {*result.edges}) for session, result in zip(files, part, strict=True)
    ]
    for (path, edges), (other_path, rest) in combinations(recorded, 2):
        common = len(edges & rest)
        # Of few edges and a coarse timer single drops may happen to be alike.
        if common and common == min(len(edges), len(rest)):
            paths = {"path": str(other_path), "other": str(path)}
            raise make_error(InputError, "session_repeated", **paths, drops=common)


def _check_whole(session: Reader, item: SessionResults, planned: int, *, unfinished: bool) -> None:
    """Refuse a session that is damaged, or lacks runs."""
    path, runs = str(session.path), item.analysis.runs
    if item.analysis.damaged:
        records = "; ".join(item.analysis.damage)
        raise make_error(InputError, "records_damaged", path=path, records=records)
    missing = planned - len(runs)
    if missing and not unfinished:
        raise make_error(
            InputError, "session_unfinished", path=path, missing=missing, planned=planned
        )
    if not any(run.verdict in GOOD for run in runs):
        raise make_error(InputError, "session_no_results", path=path)
