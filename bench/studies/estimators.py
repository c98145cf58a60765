"""Every way from edges to Δz and V: rms error against hidden truth, and time per run."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bench.studies.baselines import TimerReading, plain_fit
from bench.studies.columns import Column, aligned
from bench.studies.errors import Errors
from bench.studies.figures import estimators_figure
from bench.studies.sessions import with_device
from rig.analysis.drop import DropCase
from rig.analysis.joint_fit import joint_fit
from rig.analysis.monte_carlo import monte_carlo
from rig.analysis.quantities import COMPUTED, Adjusted, measurands
from rig.analysis.result import GOOD
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.errors import InputError
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping, Sequence

    from bench.studies.sessions import SimulatedSession
    from rig.analysis.fit import Fit
    from rig.bench.falls import SimulatedDrop
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol

    Truth = Mapping[str, Any]

TRIALS = (10**2, 10**3, 10**4, 10**5, 10**6)
_NAMES = ("separation_m", "speed_m_s")
SEED = 1
_HEAD = """\
# Error against time of each method

`./run bench estimators`: the same simulated drops read by each method, compared with the true
values. Times are of one machine: compare them with each other.

![Error against time](estimators.svg)"""


@dataclass(frozen=True, slots=True)
class Estimator:
    """One point of the picture.

    Attributes
    ----------
    name, trials
        What it is; M of a Monte Carlo, else 0.
    runs
        How many runs it gave a value for.
    seconds
        Processor time per run.
    separation_rms_m, speed_rms_m_s, separation_median_m, speed_median_m_s
        Of estimate less truth; median of its size.
    """

    name: str
    trials: int
    runs: int
    seconds: float
    separation_rms_m: float
    speed_rms_m_s: float
    separation_median_m: float
    speed_median_m_s: float


_COLUMNS: tuple[Column[Estimator], ...] = (
    Column("estimator", lambda point: point.name, numeric=False),
    Column("M", lambda point: f"{point.trials:.0e}" if point.trials else ""),
    Column("runs", lambda point: str(point.runs)),
    Column("ms per run", lambda point: f"{1e3 * point.seconds:.3g}"),
    Column("Δz rms (mm)", lambda point: f"{1e3 * point.separation_rms_m:.3f}"),
    Column("median", lambda point: f"{1e3 * point.separation_median_m:.3f}"),
    Column("V rms (mm/s)", lambda point: f"{1e3 * point.speed_rms_m_s:.2f}"),
    Column("median", lambda point: f"{1e3 * point.speed_median_m_s:.2f}"),
)


class _Case(NamedTuple):
    """A good drop, fitted by itself, with its truth."""

    protocol: Protocol
    fall: SimulatedDrop
    scale: TimeScale
    fit: Fit


def run(arguments: Namespace) -> Iterator[Findings]:
    """Simulate a session and try every estimator on the same drops."""
    say("simulating the session")
    with TemporaryDirectory() as folder:
        asked = arguments.protocol, arguments.port, arguments.seed, arguments.repeats
        session = with_device(Path(folder), *asked)
    if not session.protocol.two_chains:
        raise InputError(f"{arguments.protocol} has no two chains", "all of them measure Δz")
    points, left_out, times = estimators(session, arguments.budget)
    rows = [asdict(point) for point in points]
    record = {
        "simulated": True, "estimators": rows, "left_out": left_out, "times_lstsq": times,
    }  # fmt: skip
    lines = [*aligned(_COLUMNS, points), *(f"left out: {line}" for line in left_out)]
    lines += [f"{name}: {ratio:.1f} times numpy.linalg.lstsq" for name, ratio in times.items()]
    yield Findings(record, lines, _HEAD, rows, estimators_figure(rows), simulated=True)


def estimators(
    session: SimulatedSession, budget_s: float
) -> tuple[list[Estimator], list[str], dict[str, float]]:
    """Try every estimator on the drops of a session.

    Parameters
    ----------
    budget_s
        Seconds that a Monte Carlo may take; settings that would take longer are left out.

    Returns
    -------
    estimators, left_out, times_lstsq
        And what was left out, in words; and what the adjustments take, over one
        ``numpy.linalg.lstsq`` a chain with as many edges and unknowns.
    """
    protocol = session.protocol
    good = [
        (result, fall, scale)
        for result, fall, scale in session.results()
        if result.verdict in GOOD and result.learned
    ]
    begin = time.process_time()
    fits = [
        DropCase(protocol, result.run, fall.drop, scale).read()[1] for result, fall, scale in good
    ]
    alone_s = _since(begin, good)
    cases = [
        _Case(protocol, fall, scale, fit)
        for (_, fall, scale), fit in zip(good, fits, strict=True)
        if fit is not None
    ]
    if not cases:
        raise InputError("no good drop to compare", "take fewer disturbances, or more repeats")
    plainly = one_thread(plain_fit)
    begin = time.process_time()
    for result, fall, scale in good:
        plainly(protocol, fall.drop, result, scale.hz)
    plain_s = _since(begin, good)
    begin = time.process_time()
    joint_fit([case.fit for case in cases])
    joint_s = _since(begin, cases)
    truths = [fall.truth for _, fall, _ in good]
    own = [case.fall.truth for case in cases]
    whole = [_reading(result.quantities) for result, _, _ in good]
    alone = [_reading(measurands(case.fit.model, case.fit.estimate.x)) for case in cases]
    points = [_point("one-run fit", 0, alone_s, alone, own)]
    session_s = session.analysis_s / len(session.drops)
    points.append(_point("session fit", 0, session_s, whole, truths))
    left_out: list[str] = []
    for name, sample in (("Monte Carlo, readjusted", _readjusted), ("Monte Carlo, draws", _draws)):
        pace = 0.0
        for trials in TRIALS:
            words, expected = f"{name}, M = {trials:.0e}", pace * trials * len(cases)
            if expected > budget_s:
                left_out.append(f"{words}: about {expected:.0f} s for these runs")
                continue
            begin = time.process_time()
            readings = [sample(case, trials) for case in cases]
            each_s = _since(begin, cases)
            pace = each_s / trials
            say(f"{words}: {each_s * len(cases):.1f} s")
            # It begins with the fit of one run.
            points.append(_point(name, trials, alone_s + each_s, readings, own))
    return (
        points,
        left_out,
        {"one-run fit": alone_s / plain_s, "joint fit alone": joint_s / plain_s},
    )


def _since(begin: float, drops: Sequence[object]) -> float:
    """Processor time since a moment, for each of some drops, s."""
    return (time.process_time() - begin) / max(1, len(drops))


def mean_of_draws(fit: Fit, draws: int, seed: int, spread: float = 1.0) -> TimerReading:
    """Mean Δz and V over draws of all unknowns from their joint normal distribution.

    Each draw goes through the very functions of the unknowns that give the results.

    Parameters
    ----------
    fit
        A drop of two chains, adjusted by itself.
    draws
        M of JCGM 101.
    spread
        Of the draws, in standard uncertainties.
    """
    rng = np.random.default_rng(seed)
    model, estimate = fit.model, fit.estimate
    values, vectors = np.linalg.eigh(estimate.inverse @ estimate.inverse.T)
    root = spread * estimate.sd[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    total = np.zeros(len(_NAMES))
    for _ in range(draws):
        drop = Adjusted(model, estimate.x + root @ rng.standard_normal(estimate.x.size))
        quantities = [COMPUTED[name](drop) for name in _NAMES]
        total += [quantity.value for quantity in quantities if quantity is not None]
    return TimerReading(*(total / draws).tolist())


def _reading(quantities: Mapping[str, Any]) -> TimerReading:
    return TimerReading(*(quantities[name].value for name in _NAMES))


def _readjusted(case: _Case, trials: int) -> TimerReading:
    means = monte_carlo(case.fit, trials, SEED)
    return TimerReading(*(means[name].mean for name in _NAMES))


def _draws(case: _Case, trials: int) -> TimerReading:
    return mean_of_draws(case.fit, trials, SEED)


def _point(
    name: str,
    trials: int,
    seconds: float,
    readings: Sequence[TimerReading],
    truths: Sequence[Truth],
) -> Estimator:
    errors = [
        Errors([
            getattr(reading, quantity) - truth[quantity]
            for reading, truth in zip(readings, truths, strict=True)
        ])
        for quantity in _NAMES
    ]  # fmt: skip
    sizes = [each.sizes() for each in errors]
    figures = [size[figure] for figure in ("rms", "median") for size in sizes]
    return Estimator(name, trials, len(readings), seconds, *figures)
