"""``rig bench stability``: the model at the ends of what can be asked, against 50 digits.

What rounding of the inputs alone may cost is κ·ε, κ being the condition: the sum over the inputs of
how many times their relative errors grow. An error beyond that, but for the roundings of a sum over
all rods, is a fault of the program.
"""

from __future__ import annotations

import math
import warnings
from decimal import Decimal
from typing import TYPE_CHECKING, NamedTuple

from rig.bench import references
from rig.bench.extremes import Extreme, alone, pairs
from rig.bench.problems import beam_fit, contact, fall_time
from rig.bench.work import EPSILON, relative_error
from rig.errors import DomainError, RigError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.bench.references import Number, Values
    from rig.bench.work import WorkProblem

    Floats = Mapping[str, float]

SLACK = 4.0
"""Roundings of one leg that may count, in ε; those of n legs add up as √n."""
CONTACTS_S = tuple(10.0**-n for n in range(1, 13))
BANDS_M = tuple(10.0**-n for n in range(6))
KAPPAS = tuple(10.0**n for n in range(-15, 4, 2))
"""Ends of problems: how long impacts last, s; over how many metres the beams of a fit are spread;
1/m of the air in which the time of a fall is looked for."""
_NUDGE = Decimal("1e-22")
_MANY = 1000  # rods of which a condition is worked out
VERDICTS = ("exact", "noted", "refused", "FAILED")


class ExactCase(NamedTuple):
    """Something to compute.

    Attributes
    ----------
    inputs
        Numbers whose rounding counts.
    exact
        True values by quantity, of these inputs or of others near them.
    ours, naive
        The program's values with notes on the domain, and those of the equations as printed.
    slack, unit
        How many times κ·unit an error may be: unit is ε, or a solver's tolerance.
    """

    name: str
    inputs: Mapping[str, Number]
    exact: Callable[[Mapping[str, Number]], Values]
    ours: Callable[[], tuple[Floats, str]]
    naive: Callable[[], Mapping[str, Number]]
    slack: float = SLACK
    unit: float = EPSILON


class StabilityRow(NamedTuple):
    """One quantity of one case.

    Attributes
    ----------
    error
        Relative, against 50 digits; `None` where the model refuses.
    condition, expected
        κ, and κ·ε; of a general solver κ times its tolerance.
    backward
        Relative change of the inputs that explains the error.
    naive_error, naive
        Of the equations computed as printed with the digits and the range of a float; or its end.
    verdict
        ``exact``, ``noted`` (outside the domain, and said so), ``refused`` (a clear error), or
        ``FAILED``.
    note
        The domain note or error, word for word.
    """

    case: str
    quantity: str
    error: float | None
    condition: float
    expected: float
    backward: float
    naive_error: float | None
    naive: str
    verdict: str
    note: str


def stability(
    *, quick: bool = False, say: Callable[[str], None] = lambda _: None
) -> list[StabilityRow]:
    """Examine each quantity by itself, the problems of `rig.bench.problems`, and pairs.

    Parameters
    ----------
    quick
        Without chains of more than a thousand rods, and with few problems.
    say
        Told what goes on.
    """
    say("each quantity by itself …")
    cases = [of_fall(scene) for scene in alone() if not quick or len(scene.masses) <= _MANY]
    for make, ends in ((contact, CONTACTS_S), (beam_fit, BANDS_M), (fall_time, KAPPAS)):
        cases += [of_problem(make(end)) for end in ends[:: 4 if quick else 1]]
    rows = [row for case in cases for row in examine(case)]
    say("every two together …")
    return rows + [row for scene in pairs() for row in examine(of_fall(scene))]


def examine(case: ExactCase) -> list[StabilityRow]:
    """Compare a case with its true values, quantity by quantity; a warning counts as a failure."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values, note = case.ours()
        except (RigError, ArithmeticError, ValueError, Warning) as fault:
            verdict, words = "FAILED", f"{type(fault).__name__}: {fault}"
            if isinstance(fault, DomainError):
                verdict, words = "refused", fault.message
            return [StabilityRow(case.name, "", None, 0.0, 0.0, 0.0, None, "–", verdict, words)]
    try:
        naive, end = case.naive(), ""
    except (RigError, ArithmeticError) as fault:
        naive, end = {}, type(fault).__name__
    rows = []
    for name, (exact, condition) in _conditions(case).items():
        error, expected = relative_error(values[name], exact), case.unit * max(1.0, condition)
        plain = relative_error(float(naive[name]), exact) if naive else None
        verdict = "FAILED" if error > case.slack * expected else "noted" if note else "exact"
        rows.append(StabilityRow(
            case.name, name, error, condition, expected, error / max(1.0, condition), plain,
            end if plain is None else f"{plain:.0e}", verdict, note,
        ))  # fmt: skip
    return rows


def _conditions(case: ExactCase) -> dict[str, tuple[Decimal, float]]:
    """Return each true value and its condition."""
    values = case.exact(case.inputs)
    conditions = dict.fromkeys(values, 0.0)
    with references.many_digits():
        for name, value in case.inputs.items():
            nudged = case.exact({**case.inputs, name: Decimal(value) * (1 + _NUDGE)})
            for quantity, exact in values.items():
                if exact:
                    conditions[quantity] += float(abs(nudged[quantity] / exact - 1) / _NUDGE)
    return {name: (exact, conditions[name]) for name, exact in values.items()}


def of_fall(scene: Extreme) -> ExactCase:
    """Return the fall of a scene; of a long chain the condition is taken to be 1."""
    return ExactCase(
        scene.name, scene.inputs if len(scene.masses) <= _MANY else {},
        lambda inputs: scene.exact({**scene.inputs, **inputs}), scene.predict,
        lambda: scene.exact(scene.inputs, as_float=True), SLACK * math.sqrt(len(scene.masses)),
    )  # fmt: skip


def of_problem(problem: WorkProblem) -> ExactCase:
    """Return a problem of `rig bench precision`, by the method to choose there."""
    return ExactCase(
        problem.title, problem.inputs, lambda inputs: problem.exact(**inputs),
        lambda: (problem.best(problem.ours).values, ""),
        lambda: problem.best(problem.naive).values, unit=problem.unit,
    )  # fmt: skip
