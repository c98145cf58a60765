"""All drops of a session."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from rig.analysis.causes import causes
from rig.analysis.drop import fit_drop
from rig.analysis.learn import FEWEST, learn
from rig.analysis.lesson_json import lesson_json
from rig.analysis.pairs import Effects, effects
from rig.analysis.refine import Budgets
from rig.analysis.result import GOOD
from rig.analysis.summary import Incline, summarize
from rig.errors import InputError
from rig.protocol.measurable import check_measurable
from rig.protocol.plan import runs as planned_runs
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rig.analysis.fit import Fit
    from rig.analysis.learn import Lesson, Taught
    from rig.analysis.result import DropResult
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol
    from rig.records import Drop

    Progress = Callable[[int, int], None]

_KEPT = 0.9
"""Share of its edges that a drop must keep among others: without them priors are all it has."""
_MOVED = "somebody may have moved its gates or chains; it is judged and measured by itself"


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
    lesson
        What all good drops together teach; `None` where there are too few of them.
    adjusted
        Good drops with their unknowns, in the light of all where there is a lesson, by run and
        attempt.
    effects
        Of chains and sides, by incline; none where the plan has no blocks of A, B, B, A.
    with_rejected
        The summary as it would be with the runs that were rejected and are good by their limits;
        none where there are no such runs.
    """

    runs: tuple[DropResult, ...]
    superseded: tuple[DropResult, ...]
    summary: tuple[Incline, ...]
    lesson: Lesson | None = None
    adjusted: Mapping[tuple[int, int], Fit | Taught] = field(default_factory=dict)
    effects: tuple[Effects, ...] = ()
    with_rejected: tuple[Incline, ...] = ()

    def json(self) -> dict[str, Any]:
        """As `rig analyze --json` prints it."""
        found: dict[str, Any] = {
            "runs": [run.json() for run in self.runs],
            "summary": [line.json() for line in self.summary],
        }
        if self.superseded:
            found["superseded"] = [run.json() for run in self.superseded]
        if self.with_rejected:
            found["summary_with_rejected"] = [line.json() for line in self.with_rejected]
        if self.effects:
            found["effects"] = [one.json() for one in self.effects]
        if self.lesson is not None:
            found["learned"] = lesson_json(self.lesson)
        return found


@one_thread
def analyze(
    protocol: Protocol,
    drops: Sequence[Drop],
    scale: Callable[[Drop], TimeScale],
    rejected: Mapping[tuple[int, int], Sequence[str]] | None = None,
    progress: Progress | None = None,
) -> Analysis:
    """Analyse every drop and sum up.

    Parameters
    ----------
    protocol
        The scene and its plan.
    drops
        Raw records, several attempts at a run allowed.
    scale
        Calibration of each drop's ticks.
    rejected
        Causes by (run, attempt), for drops that the operator rejected.
    progress
        Called with the number of drops done and the number of all.

    Raises
    ------
    InputError
        A drop of a run that is not planned, or a scene that cannot be measured.
    """
    if protocol.gates is None:
        raise InputError(
            "this protocol has no gates, so there is nothing to analyse",
            "rig predict PROTOCOL says what the model expects",
        )
    check_measurable(protocol)
    planned = {run.number: run for run in planned_runs(protocol)}
    rejected = rejected or {}
    results: list[DropResult] = []
    fits: list[Fit | None] = []
    for number, drop in enumerate(drops, start=1):
        if drop.run not in planned:
            raise InputError(
                f"run {drop.run} is not in the plan, which has {len(planned)} runs",
                "is it the right protocol? rig check PROTOCOL shows the plan",
            )
        result, fit = fit_drop(protocol, planned[drop.run], drop, scale(drop))
        results.append(overruled(result, rejected.get((drop.run, drop.attempt))))
        fits.append(fit)
        if progress is not None:
            progress(number, len(drops))
    return gather(protocol, results, fits)


def overruled(result: DropResult, causes: Sequence[str] | None) -> DropResult:
    """Put the operator's causes to reject a drop, if there are any, above its limits."""
    if causes is None:
        return result
    reasons = (*causes, *result.reasons)
    return replace(result, verdict="rejected", reasons=reasons, limits=result.verdict)


@one_thread
def gather(
    protocol: Protocol, results: Sequence[DropResult], fits: Sequence[Fit | None]
) -> Analysis:
    """Let drops that were analysed one by one teach each other, and sum up.

    Parameters
    ----------
    protocol
        The scene and its plan.
    results, fits
        Of each drop, as `rig.analysis.drop.fit_drop` gives them.
    """
    return sum_up(protocol, *_taught(results, fits))


def sum_up(
    protocol: Protocol,
    results: Iterable[DropResult],
    lesson: Lesson | None = None,
    adjusted: Mapping[tuple[int, int], Fit | Taught] | None = None,
) -> Analysis:
    """Sum drops up as they are.

    Parameters
    ----------
    protocol
        The scene and its plan.
    results
        Of each drop.
    lesson, adjusted
        As in `Analysis`.
    """
    found = sorted(results, key=lambda result: (result.run.number, result.attempt))
    last = {result.run.number: result for result in found}
    latest = tuple(last.values())
    earlier = tuple(result for result in found if last[result.run.number] is not result)
    summary = tuple(summarize(protocol, latest))
    spared = any(result.limits in GOOD for result in latest)
    whole = tuple(summarize(protocol, latest, rejected=True)) if spared else ()
    paired = effects(protocol, latest)
    return Analysis(latest, earlier, summary, lesson, adjusted or {}, paired, whole)


def _taught(
    results: Sequence[DropResult], fits: Sequence[Fit | None]
) -> tuple[list[DropResult], Lesson | None, dict[tuple[int, int], Fit | Taught]]:
    """Give good drops the numbers that they have in the light of all of them.

    A verdict is on a drop by itself, by limits fixed beforehand: what others teach about the rig
    changes its numbers and never whether they count. One that loses its edges among the others
    keeps the numbers that it has by itself, and teaches nothing.
    """
    good = {
        n: fit
        for n, (result, fit) in enumerate(zip(results, fits, strict=True))
        if fit is not None and result.verdict in GOOD and fit.estimate.settled
    }
    found = list(results)
    lesson = None
    while lesson is None and len(good) >= FEWEST:
        lesson = learn(list(good.values()))
        if not lesson.settled:  # nobody is to blame for edges that such an adjustment loses
            lesson = None
            break
        for (n, fit), drop in zip(list(good.items()), lesson.drops, strict=True):
            if drop.matched < _KEPT * fit.matched:
                why = f"only {drop.matched} of its {fit.matched} edges go with the other runs"
                found[n] = replace(found[n], reasons=(*found[n].reasons, f"{why}: {_MOVED}"))
                del good[n]
                lesson = None
    keys = [(results[n].run.number, results[n].attempt) for n in good]
    if lesson is None:
        return found, None, dict(zip(keys, good.values(), strict=True))
    budgets = Budgets(lesson)
    for n, drop in zip(good, lesson.drops, strict=True):
        found[n] = replace(
            found[n],
            audit=found[n].audit.after(drop.matched),
            quantities=budgets.measured(drop),
            matches=drop.rods,
            learned=True,
            causes=causes(drop),
        )
    return found, lesson, dict(zip(keys, lesson.drops, strict=True))
