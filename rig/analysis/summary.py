"""Summary of a session: means for each incline and striking chain, with the model's values."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean, stdev
from typing import Any

from rig.analysis.averages import by_case, mean
from rig.analysis.budget_lines import COMMON, largest_first
from rig.analysis.comparison import Comparison, Difference, compare
from rig.analysis.gate_passages import GatePassage
from rig.analysis.result import DropResult, Measured, good_runs
from rig.measurands import MEASURANDS, averaged
from rig.plain_data import Record, attributes, spread
from rig.predictions import predicted_run
from rig.protocol.protocol import Condition, Protocol
from rig.units import Quantity


@dataclass(frozen=True, slots=True)
class GateMeans(Record):
    """Mean passage of an object through a gate, over all runs in which the gate saw it.

    Attributes
    ----------
    mean
        Mean of the runs' `GatePassage`.
    n
        Number of runs.
    speed_sd, interval_sd
        Standard deviations between runs, m/s and s; `None` for a single one.
    setting
        What else the plan varies.
    """

    MEMBERS = "*mean speed_sd_m_s=speed_sd? interval_sd_s=interval_sd? n setting?"

    mean: GatePassage
    n: int
    speed_sd: float | None
    interval_sd: float | None
    setting: str


@dataclass(frozen=True, slots=True)
class Incline:
    """A line of the summary.

    Attributes
    ----------
    condition
        Condition of its runs.
    means, deviations
        Mean and standard deviation between runs of each measurand, by JSON name.
    predicted
        The model's value of each measurand; missing outside its domain.
    differences
        Each mean less the model's value.
    causes
        Uncertainty of each mean that all runs share, by line of the budget.
    gates
        Mean passages of a single object through the gates.
    """

    condition: Condition
    n: int
    means: dict[str, Measured]
    deviations: dict[str, float]
    predicted: dict[str, Quantity]
    differences: Mapping[str, Difference] = field(default_factory=dict)
    causes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    gates: tuple[GateMeans, ...] = ()

    def normalized_error(self, name: str) -> float | None:
        """Return E_n of a measurand, see `Difference`; `None` without a prediction."""
        return self.differences[name].normalized_error if name in self.differences else None

    def json(self) -> dict[str, Any]:
        """Return a member of ``summary``."""
        fields: dict[str, Any] = {**self.condition.json(), "n": self.n}
        for name, value in self.means.items():
            fields[name], row = value.json(), MEASURANDS[name]
            if name in self.deviations:
                fields[row.key("sd")] = self.deviations[name]
                fields[row.key("se")] = self.deviations[name] / math.sqrt(self.n)
        fields |= {"common": spread(self.causes)} | attributes(self, "gates?")
        fields["predicted"] = {name: model.value for name, model in self.predicted.items()}
        fields["predicted_u"] = {name: model.u for name, model in self.predicted.items()}
        for number, name in enumerate(self.means):
            stem = f"_{MEASURANDS[name].stem}" if number else ""
            fields[f"normalized_error{stem}"] = self.normalized_error(name)
        return fields


def summarize(
    protocol: Protocol, results: Iterable[DropResult], *, rejected: bool = False
) -> tuple[Incline, ...]:
    """Average the good runs of each incline and, if chains differ, of each striking chain.

    Parameters
    ----------
    rejected
        As for `rig.analysis.result.good_runs`.
    """
    good = good_runs(results, rejected=rejected)
    compared, cases = compare(protocol, good), by_case(protocol, good)
    return tuple(_incline(protocol, at, runs, compared) for at, runs in cases.items())


def _incline(
    protocol: Protocol,
    condition: Condition,
    results: Sequence[DropResult],
    compared: Iterable[Comparison],
) -> Incline:
    run = results[0].run
    names = (row.name for row in averaged() if row.name in results[0].quantities)
    values = {name: [result.quantities[name] for result in results] for name in names}
    differences = {
        comparison.quantity: line
        for comparison in compared
        for line in comparison.differences
        if line.condition == condition
    }
    return Incline(
        condition,
        len(results),
        {name: mean(runs) for name, runs in values.items()},
        {name: sd for name, runs in values.items() if (sd := _scatter(runs)) is not None},
        {name: model for name, model in predicted_run(protocol, run).items() if name in values},
        differences,
        {name: _causes(runs) for name, runs in values.items()},
        tuple(_gate_means(results)),
    )


def _gate_means(results: Sequence[DropResult]) -> Iterator[GateMeans]:
    """Yield the mean passage of each gate, from the top down, in each setting."""
    passages: dict[tuple[int, str], list[GatePassage]] = {}
    for result in results:
        for gate in result.gates:
            passages.setdefault((gate.channel, result.run.setting), []).append(gate)
    for (_, setting), runs in sorted(passages.items(), key=lambda item: -item[1][0].height_m):
        speeds = [passage.speed for passage in runs]
        since = [passage.interval for passage in runs if passage.interval is not None]
        at = replace(runs[0], speed=mean(speeds), interval=mean(since) if since else None)
        yield GateMeans(at, len(runs), _scatter(speeds), _scatter(since), setting)


def _scatter(values: Sequence[Measured]) -> float | None:
    return stdev(value.value for value in values) if len(values) > 1 else None


def _causes(runs: Sequence[Measured]) -> dict[str, float]:
    """Return the contribution of each common budget line to a mean, the largest first."""
    parts = {
        name: math.sqrt(fmean(run.budget.get(name, 0.0) ** 2 for run in runs)) for name in COMMON
    }
    return largest_first({name: part for name, part in parts.items() if part})
