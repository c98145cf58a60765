"""Differences of means: how far two sets of runs are apart, and how surely."""

from __future__ import annotations

import math
from statistics import fmean, variance
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.result import Measured
from rig.analysis.summary import common_part

if TYPE_CHECKING:
    from collections.abc import Sequence


def difference(runs: Sequence[Measured], reference: Sequence[Measured]) -> Measured:
    """Return the mean of some runs less that of others.

    What runs of one joint fit share is known with its sign, as the vectors `Measured.shared`: with
    their means m and m′ the common part of the difference is |m − m′|, so that errors of one rig
    cancel (GUM 5.2.2). Of runs by themselves nothing is known to cancel.

    What runs do not share is at least what each one's own uncertainty says. Falls differ besides:
    where both sets together scatter more than that, their pooled scatter counts, as in Student's
    test of two means.
    """
    sets = (runs, reference)
    commons, parts = zip(*map(common_part, sets), strict=True)
    own = [
        fmean(max(0.0, run.u**2 - part**2) for run, part in zip(members, each, strict=True))
        for members, each in zip(sets, parts, strict=True)
    ]
    count = len(runs) + len(reference) - 2
    seen = sum(
        (len(members) - 1) * variance(run.value for run in members) / alone
        for members, alone in zip(sets, own, strict=True)
        if len(members) > 1 and alone > 0.0
    )
    degrees = least = min(max(1.0, run.degrees) for run in (*runs, *reference))
    factor = 1.0
    if count and seen > count:
        factor, degrees = seen / count, float(count)
    alone = factor * (own[0] / len(runs) + own[1] / len(reference))
    common = math.hypot(*commons) ** 2
    vectors = [[run.shared for run in members if run.shared is not None] for members in sets]
    if all(len(known) == len(members) for known, members in zip(vectors, sets, strict=True)):
        mean, reference_mean = (np.mean(known, axis=0) for known in vectors)
        common = float(np.sum((mean - reference_mean) ** 2))
    square = alone + common
    share = alone**2 / degrees + common**2 / least
    return Measured(
        fmean(run.value for run in runs) - fmean(run.value for run in reference),
        math.sqrt(square),
        square**2 / share if share > 0.0 else math.inf,
        {"runs": math.sqrt(alone), "common": math.sqrt(common)},
    )
