"""Every way from edges to Δz and V: rms error against hidden truth, and time per run."""

from __future__ import annotations

import json
import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean, median
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.studies.accuracy import repeated
from bench.studies.baselines import TimerReading, line_fit, plain_fit, two_gate_timer
from rig.analysis.drop import fit_drop
from rig.analysis.joint_fit import joint_fit
from rig.analysis.monte_carlo import monte_carlo
from rig.analysis.quantities import COMPUTED, Adjusted, measurands
from rig.analysis.result import GOOD
from rig.errors import InputError
from rig.ports import is_simulated, truth_file
from rig.results import detailed, protocol_of
from rig.runner import Operator, run_protocol
from rig.session.store import Session
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.analysis.fit import Fit
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Drop

TRIALS = (10**2, 10**3, 10**4, 10**5, 10**6)
_NAMES = ("separation_m", "speed_m_s")
SEED = 1


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
        Processor time per run; `None` where a person reads a picture.
    separation_rms_m, speed_rms_m_s, separation_median_m, speed_median_m_s
        Of estimate less truth; median of its size.
    """

    name: str
    trials: int
    runs: int
    seconds: float | None
    separation_rms_m: float
    speed_rms_m_s: float
    separation_median_m: float
    speed_median_m_s: float


@dataclass(frozen=True, slots=True)
class _Case:
    """A good drop with its truth."""

    protocol: Protocol
    run: Run
    drop: Drop
    scale: TimeScale
    fit: Fit
    truth: Mapping[str, Any]


def estimators(
    protocol: str,
    url: str,
    seed: int,
    repeats: int,
    budget_s: float,
    say: Callable[[str], None],
) -> tuple[list[Estimator], list[str], dict[str, float]]:
    """Simulate a session and try every estimator on the same drops.

    Parameters
    ----------
    protocol, repeats
        Two chains; drops at each incline.
    url, seed
        Of the simulation.
    budget_s
        Seconds that a Monte Carlo may take; settings that would take longer are left out.
    say
        Told how far it is.

    Returns
    -------
    estimators, left_out, times_lstsq
        And what was left out, in words; and what the adjustments take, over one
        ``numpy.linalg.lstsq`` a chain with as many edges and unknowns.

    Raises
    ------
    InputError
        A port that is no simulation has no truth to compare with.
    """
    if not is_simulated(url):
        raise InputError(f"{url} is no simulation", "only a simulation knows the truth: sim://")
    found: list[Estimator] = []
    with TemporaryDirectory() as folder:
        path = Path(folder) / "session"
        source = repeated(protocol, repeats, Path(folder))
        say("simulating the session")
        run_protocol(source, url, str(path), Operator(lambda _: None), seed)
        lines = truth_file(path).read_text(encoding="utf-8").splitlines()
        truths = {(one["run"], one["attempt"]): one for one in map(json.loads, lines)}
        with Session.open(path, readonly=True) as session:
            scene = protocol_of(session)
            if not scene.two_chains:
                raise InputError(f"{protocol} has no two chains", "all of them measure Δz")
            begin = time.process_time()
            analysis, clock = detailed(session)
            session_s = time.process_time() - begin
            drops = {(one.run, one.attempt): one for one in session.latest_drops()}
    good = [one for one in analysis.runs if one.verdict in GOOD and one.learned]
    keys = [(one.run.number, one.attempt) for one in good]
    cases: list[_Case] = []
    begin = time.process_time()
    for one, key in zip(good, keys, strict=True):
        scale = clock.scale(drops[key])
        fit = fit_drop(scene, one.run, drops[key], scale)[1]
        if fit is not None:
            cases.append(_Case(scene, one.run, drops[key], scale, fit, truths[key]))
    alone_s = (time.process_time() - begin) / max(1, len(good))
    fit_plainly = one_thread(plain_fit)
    begin = time.process_time()
    for one, key in zip(good, keys, strict=True):
        fit_plainly(scene, drops[key], one, clock.scale(drops[key]).hz)
    plain_s = (time.process_time() - begin) / max(1, len(good))
    if not cases:
        raise InputError("no good drop to compare", "take fewer disturbances, or more repeats")
    session_readings = [
        TimerReading(*(one.quantities[name].value for name in _NAMES)) for one in good
    ]
    alone = [_alone(one) for one in cases]
    all_truths = [truths[key] for key in keys]
    camera = [
        TimerReading(
            one["camera_separation_m"] - one["separation_raw_m"] + one["separation_m"],
            one["camera_speed_m_s"],
        )
        for one in all_truths
    ]
    found.append(_point("camera reading", 0, None, camera, all_truths))
    for name, plain in (("two-gate timer", two_gate_timer), ("line fits", line_fit)):
        begin = time.process_time()
        read = [plain(one.protocol, one.drop, one.scale.hz) for one in cases]
        took = (time.process_time() - begin) / len(cases)
        if any(one is not None for one in read):
            found.append(_raw_point(name, took, read, cases))
    ours = [one.truth for one in cases]
    found.append(_point("one-run fit", 0, alone_s, alone, ours))
    found.append(_point("session fit", 0, session_s / len(drops), session_readings, all_truths))
    left_out: list[str] = []
    for name, sample in (("Monte Carlo, readjusted", _readjusted), ("Monte Carlo, draws", _draws)):
        pace = 0.0
        for trials in TRIALS:
            expected = pace * trials * len(cases)
            if expected > budget_s:
                left_out.append(f"{name}, M = {trials:.0e}: about {expected:.0f} s for these runs")
                continue
            begin = time.process_time()
            values = [sample(one, trials) for one in cases]
            took = time.process_time() - begin
            pace = took / (trials * len(cases))
            say(f"{name}, M = {trials:.0e}: {took:.1f} s")
            seconds = alone_s + took / len(cases)  # it begins with that fit
            found.append(_point(name, trials, seconds, values, ours))
    begin = time.process_time()
    joint_fit([one.fit for one in cases])
    joint_s = (time.process_time() - begin) / len(cases)
    times = {"one-run fit": alone_s / plain_s, "joint fit alone": joint_s / plain_s}
    return found, left_out, times


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
    values, vectors = np.linalg.eigh(estimate.covariance)
    root = spread * estimate.sd[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    total = np.zeros(len(_NAMES))
    for _ in range(draws):
        drop = Adjusted(model, estimate.x + root @ rng.standard_normal(estimate.x.size))
        found = [COMPUTED[name](drop) for name in _NAMES]
        total += [one.value for one in found if one is not None]
    return TimerReading(*(total / draws).tolist())


def as_json(
    found: list[Estimator], left_out: list[str], times_lstsq: dict[str, float]
) -> dict[str, Any]:
    """As ``./run bench estimators --json`` prints it."""
    return {
        "simulated": True,
        "estimators": [asdict(one) for one in found],
        "left_out": left_out,
        "times_lstsq": times_lstsq,
    }


def _alone(case: _Case) -> TimerReading:
    found = measurands(case.fit.model, case.fit.estimate.x)
    return TimerReading(*(found[name].value for name in _NAMES))


def _readjusted(case: _Case, trials: int) -> TimerReading:
    found = monte_carlo(case.fit, trials, SEED)
    return TimerReading(*(found[name].mean for name in _NAMES))


def _draws(case: _Case, trials: int) -> TimerReading:
    return mean_of_draws(case.fit, trials, SEED)


def _raw_point(
    name: str, seconds: float, readings: list[TimerReading | None], cases: list[_Case]
) -> Estimator:
    """These know no release times: their Δz is as it happened, and compared with that."""
    pairs = [
        (one, {**case.truth, "separation_m": case.truth["separation_raw_m"]})
        for one, case in zip(readings, cases, strict=True)
        if one is not None
    ]
    return _point(name, 0, seconds, [one for one, _ in pairs], [truth for _, truth in pairs])


def _point(
    name: str,
    trials: int,
    seconds: float | None,
    readings: list[TimerReading],
    truths: list[Mapping[str, Any]],
) -> Estimator:
    errors = [
        [
            abs(getattr(one, quantity) - truth[quantity])
            for one, truth in zip(readings, truths, strict=True)
        ]
        for quantity in _NAMES
    ]
    rms = [math.sqrt(fmean(error**2 for error in each)) for each in errors]
    return Estimator(name, trials, len(readings), seconds, *rms, *map(median, errors))
