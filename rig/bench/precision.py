"""Error against run time of every method, each against 50 digits of the model that it solves.

Errors and counts are the same on every machine; times are not, and are reported only. All methods
of a scene take turns, so that a machine that slows down slows all of them down.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from rig.bench.methods import Answer, Method, Setting, absent, methods
from rig.bench.precision_reference import (
    ExactAnswer,
    Model,
    PrecisionScene,
    contact_truth,
    continuum_truth,
    discrete_truth,
    scenes,
)
from rig.bench.stability import relative_error
from rig.errors import RigError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from decimal import Decimal

    Truths = dict[float | None, ExactAnswer]

TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)
"""Relative errors of Δz for which the cheapest method is looked for."""
_TURNS, _FEWEST = 15, 3
_SHARE_S = 0.2  # of run time for one setting; less than `_FEWEST` turns it never gets
_QUICK_TURNS = 3


@dataclass(frozen=True, slots=True)
class Point:
    """One setting of one method in one scene.

    Attributes
    ----------
    model
        What the method solves and what its error is measured against: ``discrete``,
        ``continuum`` or ``contact``, the last with its contact time.
    setting, value
        In words; and the tolerance, step (s), number of nodes or contact time (s), 0 for none.
    contact_time_s
        τ, `None` where impacts take no time.
    separation_error, speed_error
        Relative, of Δz and V; 0 where no float is nearer.
    gate_error_s
        Absolute, of the time at which the top rod passes the gate.
    evaluations, steps
        As in `rig.bench.methods.Answer`.
    median_s, lower_s, upper_s
        Run time of Δz and V with its quartiles; the gate's time is not in it.
    turns
        How often it was timed.
    """

    scene: str
    method: str
    model: Model
    setting: str
    value: float
    contact_time_s: float | None
    separation_error: float | None
    speed_error: float
    gate_error_s: float | None
    evaluations: int
    steps: int
    median_s: float
    lower_s: float
    upper_s: float
    turns: int


@dataclass(frozen=True, slots=True)
class Gap:
    """How far another model is from the discrete one: no method's error.

    Attributes
    ----------
    separation_relative, speed_relative
        Other model over discrete one, less 1.
    gate_difference_s
        Other model less discrete one.
    """

    scene: str
    model: Model
    contact_time_s: float | None
    separation_relative: float
    speed_relative: float
    gate_difference_s: float


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What was not swept, and why."""

    scene: str
    method: str
    setting: str
    reason: str


@dataclass(frozen=True, slots=True)
class Cheapest:
    """The method of least median run time among those that keep to an error of Δz.

    Attributes
    ----------
    target
        Relative error of Δz allowed.
    method, setting, median_s
        `None` where no method gets there.
    """

    scene: str
    model: Model
    contact_time_s: float | None
    target: float
    method: str | None
    setting: str | None
    median_s: float | None


@dataclass(frozen=True, slots=True)
class Precision:
    """All that the sweep found."""

    scenes: tuple[tuple[str, str], ...]
    points: tuple[Point, ...]
    gaps: tuple[Gap, ...]
    left_out: tuple[LeftOut, ...]
    cheapest: tuple[Cheapest, ...]


@dataclass(slots=True)
class _Trial:
    """A setting that works, with its times so far."""

    method: Method
    setting: Setting
    answer: Answer
    gate_s: float | None
    times: list[float]
    turns: int


def precision(
    *,
    quick: bool = False,
    progress: Callable[[str], None] = lambda _line: None,
    keep: Callable[[Precision], None] = lambda _so_far: None,
) -> Precision:
    """Sweep every method on every scene of `rig.bench.precision_reference.scenes`.

    Parameters
    ----------
    quick
        A small subset: the paper's two chains, few settings.
    progress
        Told what is being done.
    keep
        Given all that is found so far after each scene: a sweep takes long.
    """
    chosen = [scene for scene in scenes() if not quick or scene.name in {"uniform", "graded"}]
    points: list[Point] = []
    gaps: list[Gap] = []
    left_out: list[LeftOut] = []
    titles: tuple[tuple[str, str], ...] = ()
    outcome = Precision((), (), (), (), ())
    for scene in chosen:
        left_out += [LeftOut(scene.name, name, "all", why) for name, why in absent(scene)]
        trials = _run_once(scene, methods(scene, quick=quick), left_out, progress, quick=quick)
        progress(f"{scene.title}: {sum(t.turns for t in trials)} timed falls in turns")
        _take_turns(trials)
        progress(f"{scene.title}: 50 digits")
        discrete, truths = _truths(scene, trials)
        points += [_point(scene, trial, discrete, truths) for trial in trials]
        gaps += _gaps(scene, discrete, truths)
        titles = (*titles, (scene.name, scene.title))
        best = tuple(cheapest(points))
        outcome = Precision(titles, tuple(points), tuple(gaps), tuple(left_out), best)
        keep(outcome)
    return outcome


def cheapest(points: Sequence[Point], targets: Sequence[float] = TARGETS) -> list[Cheapest]:
    """Find the cheapest method for each scene, model (with its contact time) and error of Δz."""
    groups: dict[tuple[str, Model, float | None], list[Point]] = {}
    for point in points:
        groups.setdefault((point.scene, point.model, point.contact_time_s), []).append(point)
    outcome = []
    for (scene, model, tau), group in groups.items():
        for target in targets:
            good = [
                point
                for point in group
                if point.separation_error is not None and point.separation_error <= target
            ]
            best = min(good, key=lambda point: point.median_s, default=None)
            winner = (best.method, best.setting, best.median_s) if best else (None, None, None)
            outcome.append(Cheapest(scene, model, tau, target, *winner))
    return outcome


def as_json(outcome: Precision) -> dict[str, object]:
    """All of it as plain objects."""
    whole = asdict(outcome)
    whole["scenes"] = [{"name": name, "title": title} for name, title in outcome.scenes]
    return whole


def _run_once(
    scene: PrecisionScene,
    lines: Sequence[Method],
    left_out: list[LeftOut],
    progress: Callable[[str], None],
    *,
    quick: bool,
) -> list[_Trial]:
    """Run every setting once; what takes too long ends its line."""
    trials = []
    for number, method in enumerate(lines, 1):
        progress(f"{scene.title}: {method.name} ({number}/{len(lines)})")
        for place, setting in enumerate(method.settings):
            try:
                begin = time.perf_counter()
                answer = setting.solve()
                took = time.perf_counter() - begin
                gate = setting.gate() if setting.gate else None
            except RigError as error:
                reason = error.message
            else:
                turns = min(_TURNS, max(_FEWEST, round(_SHARE_S / took)))
                when = gate.time_s if gate else None
                # A first run that is slow is as good a time as any later one.
                slow = turns == _FEWEST
                times = [took] if slow else []
                turns = min(turns, _QUICK_TURNS) if quick else turns
                trials.append(_Trial(method, setting, answer, when, times, turns - len(times)))
                continue
            # What follows is dearer still.
            for rest in method.settings[place:]:
                after = f"not tried: {setting.text} came to this: {reason}"
                why = reason if rest is setting else after
                left_out.append(LeftOut(scene.name, method.name, rest.text, why))
            break
    return trials


def _take_turns(trials: Sequence[_Trial]) -> None:
    """Round robin until each has had its turns."""
    for turn in range(_TURNS):
        for trial in trials:
            if turn < trial.turns:
                begin = time.perf_counter()
                trial.setting.solve()
                trial.times.append(time.perf_counter() - begin)


def _truths(scene: PrecisionScene, trials: Sequence[_Trial]) -> tuple[ExactAnswer, Truths]:
    """50 digits of each model: the discrete one, and by contact time (`None`: the continuum)."""
    truths: Truths = {}
    if scene.even:
        truths[None] = continuum_truth(scene)
    for trial in trials:
        tau = trial.setting.contact_time_s
        if tau is not None and tau not in truths:
            truths[tau] = contact_truth(scene, tau)
    return discrete_truth(scene), truths


def _point(scene: PrecisionScene, trial: _Trial, discrete: ExactAnswer, truths: Truths) -> Point:
    setting, answer, model = trial.setting, trial.answer, trial.method.model
    truth = discrete if model == "discrete" else truths[setting.contact_time_s]
    times = trial.times
    lower, median, upper = (
        statistics.quantiles(times, n=4, method="inclusive") if len(times) > 1 else 3 * times
    )
    separation = answer.separation_m
    return Point(
        scene.name,
        trial.method.name,
        model,
        setting.text,
        setting.value,
        setting.contact_time_s,
        None if separation is None else relative_error(separation, truth.separation),
        relative_error(answer.speed_m_s, truth.speed),
        None if trial.gate_s is None else absolute_error(trial.gate_s, truth.gate),
        answer.evaluations,
        answer.steps,
        median,
        lower,
        upper,
        len(times),
    )


def absolute_error(outcome: float, exact: Decimal) -> float:
    """|found − exact|; 0 where no float is nearer."""
    return 0.0 if outcome == float(exact) else float(abs(type(exact)(outcome) - exact))


def _gaps(scene: PrecisionScene, discrete: ExactAnswer, truths: Truths) -> list[Gap]:
    return [
        Gap(
            scene.name,
            "continuum" if tau is None else "contact",
            tau,
            float(truth.separation / discrete.separation - 1),
            float(truth.speed / discrete.speed - 1),
            float(truth.gate - discrete.gate),
        )
        for tau, truth in truths.items()
    ]
