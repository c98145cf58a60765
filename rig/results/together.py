"""Joint results of several sessions, and differences between them.

Each session counts once; it must be finished, undamaged, unblinded and of the same kind of scene.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from operator import attrgetter
from typing import Any

from rig.analysis.averages import by_case, combine
from rig.analysis.components import priors
from rig.analysis.owners import statements
from rig.analysis.result import GOOD, DropResult, Measured, good_runs
from rig.analysis.session import Analysis, Progress, SessionDrops, fit_sessions
from rig.analysis.summary import Incline, summarize
from rig.measurands import averaged
from rig.plain_data import Record, attributes, plain
from rig.protocol.protocol import Condition, Protocol
from rig.protocol.variants import SCENE
from rig.reasons import rig_error
from rig.results.known_drops import edges_digest
from rig.results.whole import SessionResults, check_open, complete_analysis, protocol_of, results
from rig.session.reading import Reader
from rig.threads import one_thread

Shared = Mapping[str, Sequence[Sequence[str]]]
"""Names of the sessions that share an owner of unknowns, a list for each rig, by the owner."""


@dataclass(frozen=True)
class SessionPart:
    """A session of a joint fit.

    Attributes
    ----------
    name
        Unique name of the session.
    own
        Results of the session by itself.
    analysis
        Its analysis with a joint fit.
    board
        Unique id of its board; empty if unknown.
    """

    name: str
    protocol: Protocol
    own: SessionResults
    analysis: Analysis
    board: str = ""

    @cached_property
    def cases(self) -> dict[Condition, list[DropResult]]:
        """Good runs of each condition."""
        return by_case(self.protocol, good_runs(self.analysis.runs))


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
    parts
        The sessions in the order given, with their analysis from the joint fit of all.
    shared
        From `same_owners`.
    pooled
        Means over all sessions of a scene, by their names.
    """

    parts: tuple[SessionPart, ...]
    shared: Shared
    pooled: Mapping[tuple[str, ...], Sequence[Incline]]

    @property
    def simulated(self) -> bool:
        """Whether any of the sessions is simulated."""
        return any(part.own.simulated for part in self.parts)

    @property
    def summary(self) -> tuple[Incline, ...]:
        """Means over the runs of all sessions of a scene."""
        return tuple(line for summary in self.pooled.values() for line in summary)

    def analyses(self) -> list[tuple[str, Analysis]]:
        """Return the analysis of each session from the joint fit, by name."""
        return [(part.name, part.analysis) for part in self.parts]

    def json(self) -> dict[str, Any]:
        """Return the object that ``rig analyze A B --json`` prints."""
        rig = self.parts[0].analysis.rig
        own = ((part.name, attributes(part.own, "simulated", "calibration")) for part in self.parts)
        return {
            "simulated": self.simulated,
            "sessions": [{"session": name} | fields for name, fields in own],
            "shared": self._shared_json(),
            "runs": _list("session", ((part.name, part.analysis.runs) for part in self.parts)),
            "summary": _list("sessions", self.pooled.items()),
            **(attributes(rig, "learned") if rig else {}),
        }

    def comparison_json(self) -> dict[str, Any]:
        """Return the object that ``rig compare --json`` prints."""
        return {
            "simulated": self.simulated,
            "shared": self._shared_json(),
            "means": _list("session", ((part.name, part.analysis.summary) for part in self.parts)),
            "differences": plain(self.differences()),
        }

    def _shared_json(self) -> list[dict[str, Any]]:
        return [{"what": what, "sessions": plain(groups)} for what, groups in self.shared.items()]

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
        differences = []
        for part in rest:
            for condition, runs in part.cases.items():
                alike = [key for key in first.cases if key[::2] == condition[::2]]
                same = [key for key in alike if key.impact_chain == condition.impact_chain] or alike
                pair = runs, first.cases[same[0]] if len(same) == 1 else []
                for row in averaged() if pair[1] else ():
                    if all(row.name in run.quantities for member in pair for run in member):
                        values = [[run.quantities[row.name] for run in member] for member in pair]
                        names = row.name, part.name, first.name
                        difference = combine(values, (1.0, -1.0))
                        differences.append(MeanDifference(*names, condition, difference))
        if not differences:
            raise rig_error("nothing_to_compare", path=first.name)
        return differences


@one_thread
def results_together(
    files: Sequence[Reader],
    *,
    same_rig: bool | None = None,
    unfinished: bool = False,
    fresh: bool = False,
    progress: Progress | None = None,
) -> TogetherResults:
    """Analyse several sessions in one joint fit, which starts from each session's own.

    Parameters
    ----------
    files
        Open sessions.
    same_rig
        See `same_owners`.
    unfinished
        Whether planned runs may be missing.
    fresh, progress
        As for `rig.results.whole.results`, for each session in turn.

    Raises
    ------
    InputError, SessionError
        A session cannot be added to the others, or the drops fit no common rig.
    """
    names = [session.path.name for session in files]
    names = names if len({*names}) == len(names) else [str(session.path) for session in files]
    parts = []
    for name, session in zip(names, files, strict=True):
        check_open(session)
        own, protocol = results(session, progress, fresh=fresh), protocol_of(session)
        _check_whole(session, own.analysis, len(protocol.runs()), unfinished=unfinished)
        analysis = complete_analysis(session, own, progress)
        boards = [str(identity.get("unique_id", "")) for _, identity in session.identities()]
        parts.append(SessionPart(name, protocol, own, analysis, *boards[-1:]))
    _check_repeats(files)
    kinds = [(part.protocol.vocabulary.scene, priors(part.protocol)) for part in parts]
    for name, kind in zip(names, kinds, strict=True):
        if kind != kinds[0]:
            raise rig_error("sessions_unlike", path=name, other=names[0])
    shared = same_owners(parts, same_rig=same_rig)
    analyses = fit_sessions([_with_owners(part, shared, len(parts)) for part in parts])
    if any(analysis.unsettled for analysis in analyses):
        raise rig_error("sessions_disagree", names=", ".join(names))
    fitted = tuple(
        replace(part, analysis=analysis) for part, analysis in zip(parts, analyses, strict=True)
    )
    return TogetherResults(fitted, shared, _pool_means(fitted))


def same_owners(parts: Sequence[SessionPart], *, same_rig: bool | None) -> Shared:
    """Group sessions by the owners of unknowns that they share.

    Parameters
    ----------
    same_rig
        Whether all sessions have the same rig; if `None`, those with the same protocol title and
        the same board, if known.

    Returns
    -------
    dict
        For each owner of `rig.analysis.owners.statements` the names of the sessions that share it,
        a list for each group.
    """
    owners: dict[str, dict[tuple[object, str], list[str]]] = {}
    for place, part in enumerate(parts):
        by_name = (part.protocol.title, part.board)
        rig: object = by_name if same_rig is None else same_rig or place
        for owner, statement in statements(part.protocol).items():
            owners.setdefault(owner, {}).setdefault((rig, repr(statement)), []).append(part.name)
    return {owner: list(groups.values()) for owner, groups in owners.items()}


def _list(key: str, groups: Iterable[tuple[Any, Iterable[Any]]]) -> list[dict[str, Any]]:
    """Return the members of all groups as JSON data, each with the name of its group."""
    return [{key: plain(name)} | plain(member) for name, members in groups for member in members]


def _with_owners(part: SessionPart, shared: Shared, count: int) -> SessionDrops:
    """Return a session's drops, good ones with the name suffixes of their shared unknowns."""
    owners = {  # unknowns that all sessions share keep their names
        owner: "" if len(group) == count else f" ({', '.join(group)})"
        for owner, groups in shared.items()
        for group in groups
        if part.name in group
    }
    fits = {}
    for job, fit in part.analysis.adjusted.items():
        settings = fit.model.owners
        own = {owner: suffix + settings.get(owner, "") for owner, suffix in owners.items()}
        fits[job] = replace(fit, model=fit.model.copy_with(owners=own))
    return SessionDrops(part.protocol, part.analysis.drops, fits)


def _pool_means(parts: Sequence[SessionPart]) -> dict[tuple[str, ...], tuple[Incline, ...]]:
    """Return means over all sessions with the same predictions, by their names."""
    scenes: dict[str, list[SessionPart]] = {}
    for part in parts:
        stated = attrgetter(*SCENE, "gravity", "initial_speed")
        settings = [(at, stated(scene)) for at, scene in part.protocol.settings.items()]
        scenes.setdefault(repr(settings), []).append(part)
    return {
        tuple(part.name for part in alike): summarize(
            alike[0].protocol, [run for part in alike for run in part.analysis.runs]
        )
        for alike in scenes.values()
    }


def _check_repeats(files: Iterable[Reader]) -> None:
    """Raise an error if drops would count twice: the same session, its copy or continuation."""
    recorded = (
        (str(file.path), {edges_digest(drop) for drop in file.drops() if drop.edges})
        for file in files
    )
    for (path, edges), (other, rest) in combinations(recorded, 2):
        common = len(edges & rest)
        # With few edges and a coarse timer, single drops may be equal by chance.
        if common and common == min(len(edges), len(rest)):
            raise rig_error("session_repeated", path=other, other=path, drops=common)


def _check_whole(session: Reader, analysis: Analysis, planned: int, *, unfinished: bool) -> None:
    """Raise an error for a session that is damaged, or lacks runs."""
    path, missing = str(session.path), planned - len(analysis.runs)
    if analysis.damage:
        raise rig_error("records_damaged", path=path, records="; ".join(analysis.damage))
    if missing and not unfinished:
        raise rig_error("session_unfinished", path=path, missing=missing, planned=planned)
    if not any(run.verdict in GOOD for run in analysis.runs):
        raise rig_error("session_no_results", path=path)
