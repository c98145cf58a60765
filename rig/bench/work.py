"""Error against processor time: the frame of every work–precision study.

A `WorkProblem` has reference values with an error of their own. Each `Method` is swept over its
accuracy parameter, cheapest setting first. All settings of a problem take turns on the processor,
so that a machine that slows down slows all of them down; only processor time counts.
"""

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from functools import partial
from time import process_time
from typing import Any, NamedTuple, TypeVar

from rig.bench.references import Number, Values
from rig.errors import RigError
from rig.model.fall import Fall

T = TypeVar("T")
EPSILON = 2.0**-52
SLACK = 4.0
"""Roundings of one leg that may count, in ε; those of n legs add up as √n."""
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)
"""Relative errors for which the cheapest method is looked for."""
_CALLS_S = 0.002  # of calls between two looks at the clock, which ticks in microseconds
_SHARE_S = 0.15  # of processor time for one setting, but for `_FEWEST` turns
_FEWEST, _TURNS = 3, 15


class Answer(NamedTuple):
    """What a method returns.

    Attributes
    ----------
    values
        By quantity.
    evaluations
        How often it evaluated its equations.
    note
        What it notes on the domain of its model.
    """

    values: Mapping[str, float]
    evaluations: int
    note: str = ""


def end_values(fall: Fall) -> dict[str, float]:
    """Return the quantities of a fall's end."""
    return {"separation": fall.separation_m, "speed": fall.speed_m_s, "time": fall.time_s}


class Method(NamedTuple):
    """One line of a picture.

    Attributes
    ----------
    values
        Of the accuracy parameter, cheapest first: where one fails, those after it are not tried.
    text
        A value in words, as `str.format` has it.
    solve
        Returns the answer at a value.
    """

    name: str
    values: Sequence[float]
    text: str
    solve: Callable[[float], Answer]


def direct(name: str, compute: Callable[[], Answer]) -> Method:
    """Return a method without an accuracy parameter."""
    return Method(name, [0.0], "–", lambda _: compute())


class WorkProblem(NamedTuple):
    """What all its methods solve.

    Attributes
    ----------
    name, title
        For file names, and for people.
    inputs
        Numbers whose rounding counts, by name.
    exact
        True values by quantity, from such inputs and to so many ``digits``.
    route
        How they are computed.
    ours, naive
        Names of the method to choose, and of what a plain program would do.
    unit
        Relative error that ours may make of exact inputs: a rounding, or a solver's tolerance.
    slack
        How many times `unit`, times the condition, an error may be.
    """

    name: str
    title: str
    inputs: Mapping[str, Number]
    exact: Callable[..., Values]
    route: str
    methods: Sequence[Method]
    ours: str = ""
    naive: str = ""
    unit: float = EPSILON
    slack: float = SLACK

    def best(self, name: str) -> Answer:
        """Return the answer of a method at its most accurate setting."""
        method = next(method for method in self.methods if method.name == name)
        return method.solve(method.values[-1])


class Point(NamedTuple):
    """One setting of one method, measured.

    Attributes
    ----------
    value
        Of the accuracy parameter.
    error
        The largest of `errors`, which are relative, by quantity; 0 where no float is nearer.
    cpu_s, lower_s, upper_s
        Median of the processor time of one solution, with its quartiles.
    repeats
        How often it was timed.
    """

    problem: str
    method: str
    setting: str
    value: float
    error: float
    errors: Mapping[str, float]
    evaluations: int
    cpu_s: float
    lower_s: float
    upper_s: float
    repeats: int

    def row(self) -> dict[str, Any]:
        """Return a line of a CSV table."""
        row = self._asdict()
        errors = row.pop("errors")
        return row | {f"{quantity}_error": error for quantity, error in errors.items()}


def measure(problem: WorkProblem, *, quick: bool = False) -> tuple[list[Point], list[str]]:
    """Solve a problem by every method with every setting, and time them in turns.

    Of a method that gives no answer at a setting dearer ones are not tried: it is left out from
    there on, and why is the second value.

    Parameters
    ----------
    quick
        Two settings of each method, two turns.
    """
    trials: list[tuple[partial[Answer], int, int, list[float], partial[Point]]] = []
    left_out: list[str] = []
    exact = problem.exact(**problem.inputs)
    for method in problem.methods:
        for value in method.values[:6:3] if quick else method.values:
            names = (problem.name, method.name, method.text.format(value))
            solve = partial(method.solve, value)
            try:
                answer, seconds = processor_time(solve)
                if seconds < _SHARE_S:  # a first call also loads and compiles
                    answer, seconds = processor_time(solve)
            except RigError as error:
                left_out.append(f"{names[0]}, {names[1]}, from {names[2]} on: {error.message}")
                break  # what follows is dearer still
            errors = {name: relative_error(x, exact[name]) for name, x in answer.values.items()}
            worst = max(errors.values())
            point = partial(Point, *names, value, worst, errors, answer.evaluations)
            turns = 2 if quick else min(_TURNS, max(_FEWEST, round(_SHARE_S / seconds)))
            trials.append((solve, turns, max(1, round(_CALLS_S / seconds)), [], point))
    for turn in range(_TURNS):
        for solve, turns, calls, times, _ in trials:
            if turn < turns:
                times.append(processor_time(solve, calls)[1])
    points = []
    for _, turns, _, times, point in trials:
        lower, middle, upper = statistics.quantiles(times, n=4, method="inclusive")
        points.append(point(middle, lower, upper, turns))
    return points, left_out


def processor_time(compute: Callable[[], T], calls: int = 1) -> tuple[T, float]:
    """Return what the last of so many calls gives, and the processor time of a call, s."""
    begin = process_time()
    for _ in range(calls):
        result = compute()
    return result, max((process_time() - begin) / calls, 1e-9)


def relative_error(value: float, exact: Decimal) -> float:
    """|value/exact − 1|; infinite where the value is no number, 0 where no float is nearer."""
    if value == float(exact):
        return 0.0
    if not math.isfinite(value) or exact == 0:
        return math.inf
    return float(abs(Decimal(value) / exact - 1))


def cheapest(points: Sequence[Point], target: float) -> Point | None:
    """Return the point of least processor time within a relative error; `None` without one."""
    good = [point for point in points if point.error <= target]
    return min(good, key=lambda point: point.cpu_s, default=None)
