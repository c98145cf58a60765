"""Analysis of sessions: each drop by itself, then the joint fit and the summary."""

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import lru_cache
from operator import attrgetter, length_hint
from typing import NamedTuple
from typing import Protocol as Interface

from rig.analysis.budgets import Budgets
from rig.analysis.drop import DropCase, DropSummary
from rig.analysis.edge_classes import unmatched_edges
from rig.analysis.fit import DropFit, Fit, alone
from rig.analysis.identify import FAIR
from rig.analysis.joint_fit import FEWEST, JointFit, RigEstimate, joint_fit
from rig.analysis.joint_step import JointDrop
from rig.analysis.pairs import Effects, effects
from rig.analysis.processes import do_in_order
from rig.analysis.result import GOOD, DropResult
from rig.analysis.summary import Incline, summarize
from rig.analysis.verdict import nearly_in_time, release_reasons, verdict_of
from rig.clock.calibration import TimeScale
from rig.plain_data import Record
from rig.protocol.measurable import check_measurable
from rig.protocol.protocol import Protocol, Run
from rig.reasons import Reason, make_reason, rig_error
from rig.records import Drop, Job
from rig.threads import one_thread

Progress = Callable[[int, int], None]
Causes = Mapping[tuple[int, int], Sequence[Reason]]
"""Causes by run and attempt, for drops that the operator rejected."""

Key = tuple[int, Job]
"""A session's place, and a drop of it."""
_EXPLAINED = 6  # void drops of a session for which set-up faults are searched


class SummaryByDrop(Interface):
    """Store of drop summaries, such as a dictionary."""

    def get(self, drop: Drop, /) -> DropSummary | None:
        """Return what is kept of a drop, if anything is."""

    def __setitem__(self, drop: Drop, summary: DropSummary, /) -> None:
        """Keep what follows from a drop."""


@dataclass(frozen=True, slots=True)
class Analysis(Record):
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

    MEMBERS = (
        "runs summary superseded? summary_with_rejected=with_rejected? *failure effects? *rig?"
    )

    runs: tuple[DropResult, ...]
    superseded: tuple[DropResult, ...]
    summary: tuple[Incline, ...]
    rig: RigEstimate | None = None
    joint: JointFit | None = field(default=None, compare=False)
    adjusted: Mapping[Job, Fit | JointDrop] = field(default_factory=dict, compare=False)
    effects: tuple[Effects, ...] = ()
    with_rejected: tuple[Incline, ...] = ()
    unsettled: bool = False

    @property
    def drops(self) -> list[DropResult]:
        """All attempts at all runs, by run and attempt."""
        return sorted((*self.runs, *self.superseded), key=attrgetter("job"))

    @property
    def damage(self) -> list[str]:
        """A line that counts and names the damaged drops; empty if there are none."""
        names = [str(drop.job) for drop in self.drops if drop.damaged]
        count = f"{len(names)} of {len(self.drops)} drops ({'; '.join(names)})"
        return [f"damaged records, left out: {count}; see rig recover SESSION"] if names else []

    @property
    def failure(self) -> dict[str, bool]:
        """Whether the joint fit failed, for JSON; empty if it did not."""
        return {"joint_fit_converged": False} if self.unsettled else {}


class SessionDrops(NamedTuple):
    """Drops of a session, each analysed by itself.

    Attributes
    ----------
    protocol
        The scene and its plan.
    results
        Result of each drop.
    fits
        Fits of those that take part in a joint fit, by run and attempt.
    """

    protocol: Protocol
    results: Iterable[DropResult]
    fits: Mapping[Job, DropFit]


@one_thread
def analyze(
    protocol: Protocol,
    drops: Iterable[Drop],
    scale: Callable[[Drop], TimeScale],
    rejected: Causes | None = None,
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
        As for `gather`.
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
    check_measurable(protocol)
    known: SummaryByDrop = {} if summaries is None else summaries
    total = total or length_hint(drops)

    def summarize_drops() -> Generator[tuple[DropCase, DropSummary]]:
        cases = (drop_case(protocol, drop, scale(drop)) for drop in drops)
        tasks = ((case, known.get(case.drop)) for case in cases)
        analysed, unexplained = do_in_order(_summarize, tasks, total, processes), 0
        for done, ((case, before), first) in enumerate(analysed, 1):
            # A fault of the rig affects every drop: searching in a few drops suffices.
            explain = unexplained < _EXPLAINED
            again = first.needs_explanation and first.explained != explain
            summary = case.summary(first, explain=explain) if again else first
            unexplained += summary.needs_explanation
            if summary is not before:
                known[case.drop] = summary
            yield case, summary
            if progress:
                progress(done, total)

    with closing(summarize_drops()) as summarized:  # ends other processes
        return gather(protocol, summarized, rejected or {})


def _summarize(task: tuple[DropCase, DropSummary | None]) -> DropSummary:
    case, before = task
    if before and before.scale == case.scale:
        return before
    return case.summary(before, explain=False)


@lru_cache(maxsize=8)
def plan_of(protocol: Protocol) -> Mapping[int, Run]:
    """Return the planned runs by number."""
    return {run.number: run for run in protocol.runs()}


def drop_case(protocol: Protocol, drop: Drop, scale: TimeScale) -> DropCase:
    """Return a drop with its planned run.

    Raises
    ------
    InputError
        The plan has no run of this number.
    """
    planned = plan_of(protocol)
    if drop.run not in planned:
        if drop.damage:  # the damage may be in its number
            raise rig_error("record_damaged", text=f"run {drop.run}: {drop.damage}")
        raise rig_error("run_not_planned", run=drop.run, planned=len(planned))
    return DropCase(protocol, planned[drop.run], drop, scale)


def overrule(result: DropResult, rejected: Causes) -> DropResult:
    """Return a drop's result, rejected if the operator rejected the drop."""
    causes = rejected.get(result.job)
    if causes is None:
        return result
    reasons = (*causes, *result.reasons)
    return replace(result, verdict="rejected", reasons=reasons, limits=result.verdict)


@one_thread
def gather(
    protocol: Protocol, drops: Iterable[tuple[DropCase, DropSummary]], rejected: Causes
) -> Analysis:
    """Fit drops together that were analysed individually, and summarize.

    Parameters
    ----------
    protocol
        The scene and its plan.
    drops
        Drops with their own summaries.
    rejected
        Causes by run and attempt, for drops that the operator rejected.
    """
    results, fits = [], dict[Job, DropFit]()
    for case, summary in drops:
        result = overrule(summary.result, rejected)
        results.append(result)
        if result.verdict in GOOD or nearly_in_time(result, protocol.accept.release_skew):
            fit = case.restore_drop(summary)
            fits |= {} if fit is None else {result.job: fit}
    return fit_sessions([SessionDrops(protocol, results, fits)])[0]


def fit_sessions(parts: Sequence[SessionDrops]) -> list[Analysis]:
    """Fit the drops of sessions together, and return the analysis of each session.

    A verdict depends on the drop alone, by limits fixed beforehand. The joint fit changes values,
    and a verdict only where the drop alone cannot decide whether the release skew is within its
    limit.
    """
    results = {(n, result.job): result for n, part in enumerate(parts) for result in part.results}
    fits = {(n, job): fit for n, part in enumerate(parts) for job, fit in part.fits.items()}
    joint, settled = _fit_jointly(results, fits)
    if joint is not None:
        budgets = Budgets(joint)
        for key, drop in zip(fits, joint.drops, strict=True):
            fits[key], results[key] = drop, _joint_result(results[key], drop, budgets)
    analyses = []
    for n, part in enumerate(parts):
        own = [results[key] for key in results if key[0] == n]
        adjusted = {
            job: fit if isinstance(fit, JointDrop) else alone(fit)
            for (place, job), fit in fits.items()
            if place == n and results[place, job].verdict in GOOD
        }
        analysis = sum_up(part.protocol, own, joint)
        analyses.append(replace(analysis, adjusted=adjusted, unsettled=not settled))
    return analyses


def sum_up(
    protocol: Protocol, results: Iterable[DropResult], joint: JointFit | None = None
) -> Analysis:
    """Return the analysis of a session from the results of its drops, and perhaps a joint fit."""
    ordered = sorted(results, key=attrgetter("job"))
    last = {result.run.number: result for result in ordered}
    latest = tuple(last.values())
    earlier = tuple(result for result in ordered if last[result.run.number] is not result)
    spared = any(result.limits in GOOD for result in latest)
    with_rejected = summarize(protocol, latest, rejected=True) if spared else ()
    summary, paired = summarize(protocol, latest), effects(protocol, latest)
    rig = None if joint is None else joint.rig
    return Analysis(
        latest, earlier, summary, rig, joint, effects=paired, with_rejected=with_rejected
    )


def _fit_jointly(
    results: dict[Key, DropResult], fits: dict[Key, DropFit]
) -> tuple[JointFit | None, bool]:
    """Fit drops together: the joint fit, if there is one, and whether no fit failed.

    A drop that loses matched edges in the joint fit is taken out of `fits`, with a reason in
    `results`, and keeps its own values.
    """
    drops = len(fits)
    while len(fits) >= FEWEST:
        joint = joint_fit(list(fits.values()))
        fewer = {
            key: drop.match_count
            for (key, fit), drop in zip(fits.items(), joint.drops, strict=joint.settled)
            if drop.match_count < FAIR * fit.match_count  # else its result rests on priors
        }
        # If most drops are left out, the fit has failed, not the drops.
        if not joint.settled or 2 * (drops - len(fits) + len(fewer)) > drops:
            return None, False
        if not fewer:
            return joint, True
        for key, matched in fewer.items():
            result, fit = results[key], fits.pop(key)
            counts = {"matched": matched, "alone": fit.match_count}
            why = make_reason("differs_from_session", fit.model.protocol.vocabulary, **counts)
            own = result.alone or result.quantities
            results[key] = replace(result, reasons=(*result.reasons, why), quantities=own)
    return None, True


def _joint_result(result: DropResult, drop: JointDrop, budgets: Budgets) -> DropResult:
    """Return a drop's result with the values of the joint fit."""
    unmatched, measured = unmatched_edges(drop), budgets.measure_all(drop)
    reasons = [reason for reason in result.reasons if not reason.code.startswith("release_skew")]
    reasons += release_reasons(drop.model.protocol, measured)
    return replace(
        result,
        verdict=verdict_of(reasons),
        reasons=tuple(reasons),
        audit=result.audit.count(drop.match_count, unmatched),
        quantities=measured,
        gates=budgets.gates(drop),
        rods=drop.rods_of(len(result.rods)),
        alone=result.alone or result.quantities,
        unmatched=unmatched,
    )
