"""All drops of a session."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from operator import length_hint
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar
from typing import Protocol as Interface

from rig.analysis.budgets import Budgets
from rig.analysis.drop import DropCase
from rig.analysis.edge_classes import count_unexplained, unmatched_edges
from rig.analysis.fit import alone
from rig.analysis.joint_fit import FEWEST, joint_fit
from rig.analysis.joint_step import JointDrop
from rig.analysis.pairs import Effects, effects
from rig.analysis.plain_data import attributes, plain
from rig.analysis.processes import do_in_order
from rig.analysis.result import GOOD
from rig.analysis.summary import Incline, summarize
from rig.analysis.verdict import nearly_in_time, release_reasons, verdict_of
from rig.errors import InputError
from rig.protocol.measurable import check_gates, check_measurable
from rig.protocol.plan import runs as planned_runs
from rig.reasons import make_error, make_reason
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rig.analysis.drop import DropSummary
    from rig.analysis.fit import Fit, Matched
    from rig.analysis.joint_fit import JointFit, RigEstimate
    from rig.analysis.result import DropResult
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol, Run
    from rig.reasons import Reason
    from rig.records import Drop

    Progress = Callable[[int, int], None]

K = TypeVar("K")

_EXPLAINED = 6  # void drops of a session, after which it is not sought what else the next ones are
KEPT = 0.9
"""Share of its edges that a drop must keep among others: without them priors are all it has."""


class SummaryByDrop(Interface):
    """Where summaries of drops are kept, such as a dictionary."""

    def get(self, drop: Drop, /) -> DropSummary | None: ...  # noqa: D102
    def __setitem__(self, drop: Drop, summary: DropSummary, /) -> None: ...


@dataclass(frozen=True, slots=True)
class Analysis:
    """Everything that follows from the edges of a session.

    Attributes
    ----------
    runs
        The last attempt at each planned run, by run.
    superseded
        Earlier attempts, by run and attempt.
    summary
        One line an incline.
    rig
        What the joint fit of all good drops says of the rig; `None` where there are too few.
    joint
        The joint fit itself, and
    adjusted
        good drops with their unknowns, in the light of all where there is a joint fit, by run and
        attempt: both only of an analysis that was not kept.
    effects
        Of chains and sides, by incline; none where the plan has no blocks of A, B, B, A.
    unsettled
        Whether there are enough good drops, and their joint fit did not converge.
    with_rejected
        The summary as it would be with the runs that were rejected and are good by their limits;
        none where there are no such runs.
    """

    runs: tuple[DropResult, ...]
    superseded: tuple[DropResult, ...]
    summary: tuple[Incline, ...]
    rig: RigEstimate | None = None
    joint: JointFit | None = field(default=None, compare=False)
    adjusted: Mapping[tuple[int, int], Fit | JointDrop] = field(default_factory=dict, compare=False)
    effects: tuple[Effects, ...] = ()
    with_rejected: tuple[Incline, ...] = ()
    unsettled: bool = False

    @property
    def drops(self) -> list[DropResult]:
        """All attempts at all runs, by run and attempt."""
        drops = (*self.runs, *self.superseded)
        return sorted(drops, key=lambda drop: (drop.run.number, drop.attempt))

    @property
    def damaged(self) -> tuple[DropResult, ...]:
        """Drops whose stored record is damaged."""
        return tuple(drop for drop in self.drops if drop.damaged)

    @property
    def damage(self) -> list[str]:
        """A line that counts and names the damaged drops; none where there are none."""
        names = "; ".join(f"run {drop.run.number}, attempt {drop.attempt}" for drop in self.damaged)
        count = f"{len(self.damaged)} of {len(self.drops)} drops"
        line = f"damaged records, left out: {count} ({names}); see rig recover SESSION"
        return [line] if names else []

    def json(self) -> dict[str, Any]:
        """As `rig analyze --json` prints it."""
        where_there_are = {
            "superseded": self.superseded or None,
            "summary_with_rejected": self.with_rejected or None,
            "joint_fit_converged": False if self.unsettled else None,
            "effects": self.effects or None,
            "learned": None if self.rig is None else self.rig.learned,
            "likeness": None if self.rig is None else self.rig.likeness,
        }
        fields = {name: plain(part) for name, part in where_there_are.items() if part is not None}
        return attributes(self, "runs", "summary") | fields


@one_thread
def analyze(
    protocol: Protocol,
    drops: Iterable[Drop],
    scale: Callable[[Drop], TimeScale],
    rejected: Mapping[tuple[int, int], Sequence[Reason]] | None = None,
    progress: Progress | None = None,
    summaries: SummaryByDrop | None = None,
    total: int | None = None,
    processes: int = 1,
) -> Analysis:
    """Analyse every drop and sum up.

    Parameters
    ----------
    protocol
        The scene and its plan.
    drops
        Raw records, several attempts at a run allowed; read as they are due.
    scale
        Calibration of each drop's ticks.
    rejected
        Causes by (run, attempt), for drops that the operator rejected.
    progress
        Called with the number of drops done and the number of all.
    summaries
        What is known of drops by themselves, and will be. Results are the same without.
    total
        Number of drops, where they have no length.
    processes
        That may be used, where it is worth it. Results do not depend on it.

    Raises
    ------
    InputError
        A drop of a run that is not planned, or a scene that cannot be measured.
    """
    check_gates(protocol)
    check_measurable(protocol)
    planned = {run.number: run for run in planned_runs(protocol)}
    summaries, rejected = {} if summaries is None else summaries, rejected or {}
    total = length_hint(drops) if total is None else total
    results: list[DropResult] = []
    drops_adjusted: list[Matched | None] = []
    unexplained = 0

    def take(task: tuple[DropCase, DropSummary | None], summary: DropSummary) -> None:
        nonlocal unexplained
        case, before = task
        # What is wrong with a rig is wrong in drop after drop: some of them tell it.
        explain = unexplained < _EXPLAINED
        if summary.unexplained and summary.explained != explain:
            summary = case.summary(summary, explain=explain)
        unexplained += summary.unexplained
        if summary is not before:
            summaries[case.drop] = summary
        result = overruled(summary.result, rejected.get((case.run.number, case.drop.attempt)))
        results.append(result)
        drops_adjusted.append(case.adjusted(summary) if joins(protocol, result) else None)
        if progress is not None:
            progress(len(results), total)

    cases = (DropCase(protocol, planned_run(planned, drop), drop, scale(drop)) for drop in drops)
    do_in_order(
        _summarize, ((case, summaries.get(case.drop)) for case in cases), take, total, processes
    )
    return gather(protocol, results, drops_adjusted)


def _summarize(task: tuple[DropCase, DropSummary | None]) -> DropSummary:
    case, before = task
    if before is not None and before.scale == case.scale:
        return before
    return case.summary(before, explain=False)


def planned_run(planned: Mapping[int, Run], drop: Drop) -> Run:
    """Find the run of the plan that a drop was.

    Raises
    ------
    InputError
        There is none.
    """
    if drop.run not in planned:
        if drop.damage:  # its number is what was altered
            raise make_error(InputError, "record_damaged", text=f"run {drop.run}: {drop.damage}")
        raise InputError(
            f"run {drop.run} is not in the plan, which has {len(planned)} runs",
            "is it the right protocol? rig check PROTOCOL shows the plan",
        )
    return planned[drop.run]


def overruled(result: DropResult, causes: Sequence[Reason] | None) -> DropResult:
    """Put the operator's causes to reject a drop, if there are any, above its limits."""
    if causes is None:
        return result
    reasons = (*causes, *result.reasons)
    return replace(result, verdict="rejected", reasons=reasons, limits=result.verdict)


def joins(protocol: Protocol, result: DropResult) -> bool:
    """Whether a drop that is so by itself may take part in a joint fit."""
    return result.verdict in GOOD or nearly_in_time(result, protocol.accept.release_skew)


@one_thread
def gather(
    protocol: Protocol, results: Sequence[DropResult], drops: Sequence[Matched | None]
) -> Analysis:
    """Fit drops together that were analysed one by one, and sum up.

    Parameters
    ----------
    protocol
        The scene and its plan.
    results, drops
        Of each by itself; `None` for the unknowns of one that does not join.
    """
    good = {n: drop for n, drop in enumerate(drops) if drop is not None}
    together = fit_together(dict(enumerate(results)), good)
    adjusted = {
        (result.run.number, result.attempt): drop if isinstance(drop, JointDrop) else alone(drop)
        for n, drop in together.drops.items()
        if (result := together.results[n]).verdict in GOOD
    }
    analysis = sum_up(protocol, together.results.values(), together.joint, adjusted)
    return replace(analysis, unsettled=not together.settled)


def sum_up(
    protocol: Protocol,
    results: Iterable[DropResult],
    joint: JointFit | None = None,
    adjusted: Mapping[tuple[int, int], Fit | JointDrop] | None = None,
) -> Analysis:
    """Sum drops up as they are.

    Parameters
    ----------
    protocol
        The scene and its plan.
    results
        Of each drop.
    joint, adjusted
        As in `Analysis`.
    """
    ordered = sorted(results, key=lambda result: (result.run.number, result.attempt))
    last = {result.run.number: result for result in ordered}
    latest = tuple(last.values())
    earlier = tuple(result for result in ordered if last[result.run.number] is not result)
    summary = tuple(summarize(protocol, latest))
    spared = any(result.limits in GOOD for result in latest)
    with_rejected = tuple(summarize(protocol, latest, rejected=True)) if spared else ()
    paired = effects(protocol, latest)
    rig = None if joint is None else joint.rig
    return Analysis(latest, earlier, summary, rig, joint, adjusted or {}, paired, with_rejected)


class FittedTogether(NamedTuple, Generic[K]):
    """Drops in the light of all.

    Attributes
    ----------
    joint
        `None` where there are too few drops, or their fit failed.
    results
        Of all that were given.
    drops
        Those in the fit or, where there is none, as they would have gone into it.
    settled
        Whether nothing failed.
    """

    joint: JointFit | None
    results: dict[K, DropResult]
    drops: Mapping[K, Matched]
    settled: bool = True


def fit_together(results: Mapping[K, DropResult], drops: Mapping[K, Matched]) -> FittedTogether[K]:
    """Give good drops the numbers that they have in the light of all of them.

    A verdict is on a drop by itself, by limits fixed beforehand: what others say of the rig
    changes its numbers and not whether they count, but for a release so near the limit that the
    drop alone cannot tell. One that loses its edges among the others keeps the numbers that it has
    by itself, and is left out.

    Parameters
    ----------
    results, drops
        Of any drops, and of these the good ones with their unknowns.
    """
    outcome, good = dict(results), dict(drops)
    while len(good) >= FEWEST:
        joint = joint_fit(list(good.values()))
        fewer = {
            key: drop.matched
            for (key, fit), drop in zip(good.items(), joint.drops, strict=joint.settled)
            if drop.matched < KEPT * fit.matched
        }
        # Where most are left out it is the adjustment that fails, and no drop is to blame for that.
        if not joint.settled or 2 * (len(drops) - len(good) + len(fewer)) > len(drops):
            return FittedTogether(None, outcome, good, settled=False)
        if not fewer:
            adjusted, budgets = dict(zip(good, joint.drops, strict=True)), Budgets(joint)
            light = {
                key: _joint_result(outcome[key], drop, budgets) for key, drop in adjusted.items()
            }
            return FittedTogether(joint, outcome | light, adjusted)
        for key, matched in fewer.items():
            result, fit = outcome[key], good.pop(key)
            counts = {"matched": matched, "alone": fit.matched}
            why = make_reason("differs_from_session", fit.model.protocol.vocabulary, **counts)
            own = result.alone or result.quantities
            outcome[key] = replace(result, reasons=(*result.reasons, why), quantities=own)
    return FittedTogether(None, outcome, good)


def _joint_result(result: DropResult, drop: JointDrop, budgets: Budgets) -> DropResult:
    """Give a drop the numbers that it has in the light of all."""
    unmatched, measured = unmatched_edges(drop), budgets.measured(drop)
    reasons = [reason for reason in result.reasons if not reason.code.startswith("release_skew")]
    reasons += release_reasons(drop.model.protocol, measured)
    return replace(
        result,
        verdict=verdict_of(reasons),
        reasons=tuple(reasons),
        audit=result.audit.count(drop.matched, count_unexplained(unmatched)),
        quantities=measured,
        gates=budgets.gates(drop),
        matches=drop.rods,
        alone=result.alone or result.quantities,
        unmatched=unmatched,
    )
