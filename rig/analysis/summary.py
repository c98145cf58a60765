"""All runs of one incline together, beside the model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.result import GOOD, Measured
from rig.analysis.student import coverage_factor
from rig.predictions import predicted_run
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rig.analysis.result import DropResult
    from rig.protocol.scene import Protocol, Run

COMMON = frozenset(
    {
        "clock",
        "gravity",
        "air",
        "drop height",
        "beam heights",
        "beam offsets",
        "rod places",
        "rod width",
    }
)
"""Budget lines that are the same in every run, so that averaging does not reduce them."""
MEASURANDS = ("separation_m", "speed_m_s", "gravity_m_s2")


@dataclass(frozen=True, slots=True)
class Incline:
    """One line of the summary.

    Attributes
    ----------
    means, deviations
        Mean and standard deviation between runs of each measurand, by JSON name.
    predicted
        The model's value of each measurand; missing outside its domain.
    """

    incline_deg: float
    n: int
    means: dict[str, Measured]
    deviations: dict[str, float]
    predicted: dict[str, Quantity]

    def normalized_error(self, name: str) -> float | None:
        """E_n = (measured − predicted)/√(U² + U_p²); within ±1 they agree (ISO 13528)."""
        if name not in self.means or name not in self.predicted:
            return None
        mean, model = self.means[name], self.predicted[name]
        width = math.hypot(mean.expanded, coverage_factor(math.inf) * model.u)
        return (mean.value - model.value) / width if width > 0.0 else None

    def json(self) -> dict[str, Any]:
        """One member of ``summary``."""
        found: dict[str, Any] = {"incline_deg": self.incline_deg, "n": self.n}
        for name, mean in self.means.items():
            found[name] = mean.json()
            if name in self.deviations:
                symbol, _, unit = name.partition("_")
                found[f"{symbol}_sd_{unit}"] = self.deviations[name]
                found[f"{symbol}_se_{unit}"] = self.deviations[name] / math.sqrt(self.n)
        found["predicted"] = {name: model.value for name, model in self.predicted.items()}
        found["predicted_u"] = {name: model.u for name, model in self.predicted.items()}
        main, *others = self.means
        found["normalized_error"] = self.normalized_error(main)
        found |= {
            f"normalized_error_{name.partition('_')[0]}": self.normalized_error(name)
            for name in others
        }
        return found


def summarize(
    protocol: Protocol, results: Iterable[DropResult], *, rejected: bool = False
) -> list[Incline]:
    """Average the good runs of each incline, in order of incline.

    Parameters
    ----------
    rejected
        Whether runs that are good by their limits count though the operator rejected them.
    """
    by_incline: dict[float, list[DropResult]] = {}
    for result in results:
        if result.verdict in GOOD or (rejected and result.limits in GOOD):
            by_incline.setdefault(result.run.incline_deg, []).append(result)
    return [_incline(protocol, incline, runs) for incline, runs in sorted(by_incline.items())]


def _incline(protocol: Protocol, incline: float, results: Sequence[DropResult]) -> Incline:
    names = [name for name in MEASURANDS if name in results[0].quantities]
    values = {name: [result.quantities[name] for result in results] for name in names}
    return Incline(
        incline,
        len(results),
        {name: mean(found) for name, found in values.items()},
        {
            name: stdev(one.value for one in found)
            for name, found in values.items()
            if len(found) > 1
        },
        _predicted(protocol, [result.run for result in results], names),
    )


def mean(runs: Sequence[Measured]) -> Measured:
    """Mean of several runs: their scatter over √n, and what is common to all of them.

    Where the runs happen to scatter less than each one's own uncertainty allows, the latter
    counts. Degrees of freedom are effective ones (GUM G.4).
    """
    n = len(runs)
    common, each = _common(runs)
    own = math.sqrt(
        fmean(max(0.0, run.u**2 - part**2) for run, part in zip(runs, each, strict=True))
    )
    seen = stdev(run.value for run in runs) if n > 1 else 0.0
    single = max(own, seen) / math.sqrt(n)
    u = math.hypot(single, common)
    degrees = (n - 1) * (u / single) ** 4 if seen > own else math.inf
    return Measured(
        fmean(run.value for run in runs), u, degrees, {"runs": single, "common": common}
    )


def _common(runs: Sequence[Measured]) -> tuple[float, list[float]]:
    """What averaging leaves, of the mean and of each run.

    Runs of one session share errors with known signs, which may cancel where chains change places.
    Of runs by themselves only the sources are known.
    """
    shared = [run.shared for run in runs if run.shared is not None]
    if len(shared) == len(runs):
        together = np.mean(shared, axis=0)
        return math.sqrt(together @ together), [math.sqrt(one @ one) for one in shared]
    each = [math.hypot(*(u for name, u in run.budget.items() if name in COMMON)) for run in runs]
    return math.sqrt(fmean(part**2 for part in each)), each


def _predicted(
    protocol: Protocol, runs: Sequence[Run], names: Sequence[str]
) -> dict[str, Quantity]:
    """Return what the model says for these runs; unlike chains count as often as they struck."""
    if protocol.surface is None:
        return {"gravity_m_s2": protocol.gravity} if "gravity_m_s2" in names else {}
    separations: list[Quantity] = []
    speeds: list[Quantity] = []
    known: dict[tuple[str | None, str | None], tuple[Quantity | None, Quantity | None]] = {}
    for run in runs:
        case = run.impact, run.free
        if case not in known:
            known[case] = predicted_run(protocol, run)
        separation, speed = known[case]
        if separation is None or speed is None:
            return {}
        separations.append(separation)
        speeds.append(speed)
    # The model's parameters are common to all runs, so its uncertainty does not average out.
    found = {
        "separation_m": Quantity(fmean(q.value for q in separations), separations[0].u),
        "speed_m_s": Quantity(fmean(q.value for q in speeds), speeds[0].u),
    }
    return {name: found[name] for name in names if name in found}
