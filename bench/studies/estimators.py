"""Every way from edges to Δz and V: rms error against hidden truth, and time for all drops."""

from __future__ import annotations

import math
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from statistics import fmean
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.columns import points_table
from bench.studies.falls import Asked, simulation
from bench.studies.sessions import with_repeats, without_device
from rig.analysis.drop import DropCase
from rig.analysis.monte_carlo import monte_carlo
from rig.analysis.quantities import measurands
from rig.analysis.result import GOOD
from rig.analysis.session import analyze
from rig.bench.references import DIGITS
from rig.bench.work import Answer, Method, WorkProblem, direct, measure
from rig.commands.bench_precision import Study
from rig.commands.output import say
from rig.errors import InputError
from rig.protocol import reader
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from bench.studies.sessions import SimulatedSession
    from rig.analysis.fit import Fit
    from rig.bench.findings import Findings

NAMES = {"separation": "separation_m", "speed": "speed_m_s"}
TRIALS = (10, 100)
"""Of the Monte Carlo, in which each adjusts all unknowns again."""
SEED = 1
_HEAD = """\
# Error against time of each method

`./run bench estimators`: the same simulated drops read by each method. An error is the rms error of
all drops over the rms of the true values. A Monte Carlo begins with the fit of one run. Times are
of one machine: compare them with each other.

"""


def run(arguments: Namespace) -> Iterator[Findings]:
    """Simulate a session and try every estimator on the same drops."""
    say("simulating the session")
    with TemporaryDirectory() as folder:
        path = with_repeats(arguments.protocol, arguments.repeats, Path(folder))
        protocol = reader.read(path)
        numbers = [run.number for run in protocol.runs()]
        asked = Asked(simulation(path), [arguments.seed], [numbers])
        (session,) = without_device([(protocol, asked)])
    if not protocol.two_chains:
        raise InputError(f"{arguments.protocol} has no two chains", "all of them measure Δz")
    study = Study("estimators", _HEAD)
    say("trying every estimator")
    problem = problem_of(session)
    study.add(problem, *one_thread(measure)(problem))
    yield replace(study.findings(points_table(study.points)), simulated=True)


def problem_of(session: SimulatedSession) -> WorkProblem:
    """Return the problem of reading the good drops of a session of two chains."""
    good = [
        (DropCase(session.protocol, result.run, fall.drop, scale), fall.truth)
        for result, fall, scale in session.results()
        if result.verdict in GOOD and result.learned
    ]
    good = [(case, truth) for case, truth in good if case.read()[1] is not None]
    if not good:
        raise InputError("no good drop to compare", "take fewer disturbances, or more repeats")
    truths = [truth for _, truth in good]

    def answer(readings: Sequence[Mapping[str, float]]) -> Answer:
        pairs = [*zip(readings, truths, strict=True)]
        errors = {
            name: _rms([reading[key] - truth[key] for reading, truth in pairs])
            / _rms([truth[key] for truth in truths])
            for name, key in NAMES.items()
        }
        return Answer({name: 1.0 + error for name, error in errors.items()}, len(good))

    def alone(read: Callable[[Fit], Mapping[str, float]]) -> Answer:
        fits = [case.read()[1] for case, _ in good]
        return answer([read(fit) for fit in fits if fit is not None])

    def together() -> Answer:
        drops, scale = [case.drop for case, _ in good], good[0][0].scale
        runs = analyze(session.protocol, drops, lambda _: scale).runs
        return answer([_values(result.quantities) for result in runs])

    return WorkProblem(
        "drops", f"{len(good)} drops of two chains", {}, _one, "the simulation's hidden truth",
        [
            direct("one-run fit (rig)",
                   lambda: alone(lambda fit: _values(measurands(fit.model, fit.estimate.x)))),
            direct("session fit (rig)", together),
            Method("Monte Carlo, readjusted", TRIALS, "M = {:.0f}",
                   lambda trials: alone(lambda fit: _readjusted(fit, int(trials)))),
        ],
    )  # fmt: skip


def _one(digits: int = DIGITS) -> dict[str, Decimal]:
    """Return what readings without an error would be of the true values."""
    del digits
    return dict.fromkeys(NAMES, Decimal(1))


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(fmean(value**2 for value in values))


def _values(quantities: Mapping[str, Any]) -> dict[str, float]:
    return {key: quantities[key].value for key in NAMES.values()}


def _readjusted(fit: Fit, trials: int) -> dict[str, float]:
    means = monte_carlo(fit, trials, SEED)
    return {key: means[key].mean for key in NAMES.values()}
