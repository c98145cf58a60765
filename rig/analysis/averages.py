"""Means of runs, and weighted sums of means, each with its uncertainty.

A part of each run's variance is independent; the rest is common to all runs of a rig, and
averaging does not reduce it. For runs of a joint fit the common part has a sign, in the vectors
`Measured.shared`, and may cancel (GUM 5.2.2). For other runs only the budget lines are known.
"""

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import TypeVar

import numpy as np

from rig.analysis.budget_lines import COMMON
from rig.analysis.result import Measured
from rig.protocol.protocol import Condition, Protocol, Run

T = TypeVar("T")


def by_case(
    protocol: Protocol, members: Iterable[T], run_of: Callable[[T], Run] = attrgetter("run")
) -> dict[Condition, list[T]]:
    """Group members by incline, striking chain if chains differ, and setting, in order."""
    groups: dict[Condition, list[T]] = {}
    for member in members:
        groups.setdefault(protocol.condition(run_of(member)), []).append(member)
    places = {setting: place for place, setting in enumerate(protocol.variants)}
    in_order = sorted(groups, key=lambda at: (at[:2], places.get(at.setting)))
    return {condition: groups[condition] for condition in in_order}


def mean(runs: Sequence[Measured]) -> Measured:
    """Return the mean of several runs, with their scatter over √n and the common uncertainty."""
    average = combine([runs], [1.0])
    if len(runs) > 1:
        return average
    return replace(runs[0], budget=average.budget, deviation=None)


def combine(
    groups: Sequence[Sequence[Measured]],
    weights: Iterable[float],
    scatter: tuple[float, float] | None = None,
    lines: Collection[str] = COMMON,
) -> Measured:
    """Return a weighted sum of the means of groups of runs.

    The larger of the runs' own uncertainty and their scatter counts. Degrees of freedom are
    effective (GUM G.4); more runs do not increase those of the runs' own uncertainty.

    Parameters
    ----------
    weights
        Weight of each group's mean.
    scatter
        Standard uncertainty of the sum by the scatter of the runs, and its degrees of freedom; by
        default that of the pooled scatter within groups, as in Student's test of two means.
    lines
        Budget lines that all runs of a group share, but not different groups, if they were not
        fitted jointly.
    """
    runs = [run for group in groups for run in group]
    joint = all(run.shared is not None for run in runs)
    value, own, chi2, common = 0.0, 0.0, 0.0, []
    for weight, group in zip(weights, groups, strict=True):
        values, u2 = np.array([(run.value, run.u**2) for run in group]).T
        budgets = [[run.budget.get(name, 0.0) for name in lines] for run in group]
        shared = np.array([run.shared for run in group] if joint else budgets, float)
        parts = np.sum(shared**2, axis=1)
        # Scatter is finite relative to the variance of exact runs, too.
        single = max(float(np.maximum(0.0, u2 - parts).mean()), float(np.finfo(float).tiny))
        value += weight * float(values.mean())
        own += weight**2 * single / len(group)
        chi2 += float(np.sum((values - values.mean()) ** 2)) / single
        common.append(weight * (shared.mean(axis=0) if joint else np.sqrt(parts.mean())))
    freedom = max(1.0, len(runs) - len(groups))
    vector = sum(common) if joint else None
    foretold, share = math.sqrt(own), float(np.linalg.norm(common if vector is None else vector))
    seen, freedom = scatter or (foretold * math.sqrt(chi2 / freedom), freedom)
    single, degrees_alone = max(foretold, seen), min(max(1.0, run.degrees) for run in runs)
    u = math.hypot(single, share)
    fourth = single**4 / (freedom if seen > foretold else degrees_alone) + share**4 / degrees_alone
    degrees = u**4 / fourth if fourth > 0.0 else math.inf
    return Measured(value, u, degrees, {"runs": single, "common": share}, vector)
