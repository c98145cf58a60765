"""Analysis of a session: each drop by itself, then the joint fit and the summary."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import length_hint
from typing import Any, Generic, NamedTuple, TypeVar
from typing import Protocol as Interface

from rig.analysis.budgets import Budgets
from rig.analysis.drop import DropCase, DropSummary
from rig.analysis.edge_classes import count_unexplained, unmatched_edges
from rig.analysis.fit import DropFit, Fit, alone
from rig.analysis.joint_fit import FEWEST, JointFit, RigEstimate, joint_fit
from rig.analysis.joint_step import JointDrop
from rig.analysis.pairs import Effects, effects
from rig.analysis.plain_data import attributes, plain
from rig.analysis.processes import do_in_order
from rig.analysis.result import GOOD, DropResult
from rig.analysis.summary import Incline, summarize
from rig.analysis.verdict import nearly_in_time, release_reasons, verdict_of
from rig.clock.calibration import TimeScale
from rig.protocol.measurable import check_gates, check_measurable
from rig.protocol.plan import runs as planned_runs
from rig.protocol.protocol import Protocol, Run
from rig.reasons import Reason, make_reason, rig_error
from rig.records import Drop
from rig.threads import one_thread

Progress = Callable[[int, int], None]

K = TypeVar("K")

_EXPLAINED = 6  # void drops of a session for which set-up faults are searched
KEPT = 0.9
"""Least share of its matched edges that a drop must keep in the joint fit: with fewer, its result
rests on priors."""


class SummaryByDrop(Interface):
    """Store of drop summaries, such as a dictionary."""

    def get(self, drop: Drop, /) -> DropSummary | None:
        """Return what is kept of a drop, if anything is."""

    def __setitem__(self, drop: Drop, summary: DropSummary, /) -> None:
        """Keep what follows from a drop."""


@dataclass(frozen=True, slots=True)
class Analysis:
    """All results of a session.

    Attributes
    ----------
    runs
        The last attempt at each planned run, by run.
    superseded
        Earlier attempts, by run and attempt.
    summary
        A line for each incline.
    rig
        Results of the joint fit about the rig; `None` if there are too few good drops.
    joint
        The joint fit; not stored with an analysis.
    adjusted
        Good drops with their fitted unknowns, by run and attempt, from the joint fit if there is
        one; not stored with an analysis.
    effects
        Effects of chains and sides, by incline; empty if the plan has no blocks of A, B, B, A.
    unsettled
        Whether there are enough good drops but their joint fit did not converge.
    with_rejected
        The summary including rejected runs that are good by their limits; empty if there are none.
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
        """A line that counts and names the damaged drops; empty if there are none."""
        names = "; ".join(f"run {drop.run.number}, attempt {drop.attempt}" for drop in self.damaged)
        count = f"{len(self.damaged)} of {len(self.drops)} drops"
        line = f"damaged records, left out: {count} ({names}); see rig recover SESSION"
        return [line] if names else []

    def json(self) -> dict[str, Any]:
        """Return the object that `rig analyze --json` prints."""
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
    """Analyse every drop, fit the good ones together, and summarize.

    Parameters
    ----------
    protocol
        The scene and its plan.
    drops
        Raw records, read lazily; a run may have several attempts.
    scale
        Function that returns the calibration of a drop's ticks.
    rejected
        Causes by (run, attempt), for drops that the operator rejected.
    progress
        Called with the number of drops done and the total.
    summaries
        Cache of the drops' own summaries, updated in place. Results are the same without it.
    total
        Number of drops, if `drops` has no length.
    processes
        Greatest number of processes. Results do not depend on it.

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
    drops_adjusted: list[DropFit | None] = []
    unexplained = 0

    def take(task: tuple[DropCase, DropSummary | None], summary: DropSummary) -> None:
        nonlocal unexplained
        case, before = task
        # A fault of the rig affects every drop: searching in a few drops suffices.
        explain = unexplained < _EXPLAINED
        if summary.needs_explanation and summary.explained != explain:
            summary = case.summary(summary, explain=explain)
        unexplained += summary.needs_explanation
        if summary is not before:
            summaries[case.drop] = summary
        result = overrule(summary.result, rejected.get((case.run.number, case.drop.attempt)))
        results.append(result)
        drops_adjusted.append(case.restore_drop(summary) if joins(protocol, result) else None)
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
    """Return the planned run of a drop.

    Raises
    ------
    InputError
        The plan has no run of this number.
    """
    if drop.run not in planned:
        if drop.damage:  # the damage may be in its number
            raise rig_error("record_damaged", text=f"run {drop.run}: {drop.damage}")
        raise rig_error("run_not_planned", run=drop.run, planned=len(planned))
    return planned[drop.run]


def overrule(result: DropResult, causes: Sequence[Reason] | None) -> DropResult:
    """Return a result rejected for the operator's causes; unchanged if there are none."""
    if causes is None:
        return result
    reasons = (*causes, *result.reasons)
    return replace(result, verdict="rejected", reasons=reasons, limits=result.verdict)


def joins(protocol: Protocol, result: DropResult) -> bool:
    """Whether a drop takes part in the joint fit, given its own result."""
    return result.verdict in GOOD or nearly_in_time(result, protocol.accept.release_skew)


@one_thread
def gather(
    protocol: Protocol, results: Sequence[DropResult], drops: Sequence[DropFit | None]
) -> Analysis:
    """Fit drops together that were analysed individually, and summarize.

    Parameters
    ----------
    protocol
        The scene and its plan.
    results, drops
        Each drop's own result and fit; `None` for the fit of a drop that does not take part.
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
    """Return the analysis of a session from the results of its drops.

    Parameters
    ----------
    protocol
        The scene and its plan.
    results
        Result of each drop.
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
    """Drops after a joint fit.

    Attributes
    ----------
    joint
        `None` if there are too few drops, or their fit did not converge.
    results
        Results of all drops.
    drops
        Drops of the joint fit; without a joint fit, the input to it.
    settled
        Whether no fit failed.
    """

    joint: JointFit | None
    results: dict[K, DropResult]
    drops: Mapping[K, DropFit]
    settled: bool = True


def fit_together(results: Mapping[K, DropResult], drops: Mapping[K, DropFit]) -> FittedTogether[K]:
    """Fit good drops together and update their results.

    A verdict depends on the drop alone, by limits fixed beforehand. The joint fit changes values,
    and a verdict only where the drop alone cannot decide whether the release skew is within its
    limit. A drop that loses matched edges in the joint fit is left out and keeps its own values.

    Parameters
    ----------
    results, drops
        Results of all drops, and the fits of the good ones.
    """
    outcome, good = dict(results), dict(drops)
    while len(good) >= FEWEST:
        joint = joint_fit(list(good.values()))
        fewer = {
            key: drop.match_count
            for (key, fit), drop in zip(good.items(), joint.drops, strict=joint.settled)
            if drop.match_count < KEPT * fit.match_count
        }
        # If most drops are left out, the fit has failed, not the drops.
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
            counts = {"matched": matched, "alone": fit.match_count}
            why = make_reason("differs_from_session", fit.model.protocol.vocabulary, **counts)
            own = result.alone or result.quantities
            outcome[key] = replace(result, reasons=(*result.reasons, why), quantities=own)
    return FittedTogether(None, outcome, good)


def _joint_result(result: DropResult, drop: JointDrop, budgets: Budgets) -> DropResult:
    """Return a drop's result with the values of the joint fit."""
    unmatched, measured = unmatched_edges(drop), budgets.measure_all(drop)
    reasons = [reason for reason in result.reasons if not reason.code.startswith("release_skew")]
    reasons += release_reasons(drop.model.protocol, measured)
    return replace(
        result,
        verdict=verdict_of(reasons),
        reasons=tuple(reasons),
        audit=result.audit.count(drop.match_count, count_unexplained(unmatched)),
        quantities=measured,
        gates=budgets.gates(drop),
        rods=drop.rods_of(len(result.rods)),
        alone=result.alone or result.quantities,
        unmatched=unmatched,
    )
