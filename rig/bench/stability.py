"""``rig bench stability``: the model at the ends of what can be asked, against 50 digits.

What rounding of the inputs alone may cost is κ·ε, κ being the condition: the sum over the inputs of
how many times their relative errors grow. An error beyond that, but for the roundings of a sum over
all rods, is a fault of the program.
"""

import math
import warnings
from decimal import Decimal
from typing import NamedTuple

from rig.bench import references
from rig.bench.extremes import Extreme, alone, pairs
from rig.bench.problems import beam_fit, contact, fall_time
from rig.bench.work import SLACK, WorkProblem, direct, relative_error
from rig.errors import DomainError, RigError
from rig.streams import say

CONTACTS_S = tuple(10.0**-n for n in range(1, 13))
BANDS_M = tuple(10.0**-n for n in range(6))
KAPPAS = tuple(10.0**n for n in range(-15, 4, 2))
"""Ends of problems: how long impacts last, s; over how many metres the beams of a fit are spread;
1/m of the air in which the time of a fall is looked for."""
_NUDGE = Decimal("1e-22")
_MANY = 1000  # rods of which a condition is worked out
VERDICTS = ("exact", "noted", "refused", "FAILED")


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


def stability(*, quick: bool) -> list[StabilityRow]:
    """Examine each quantity by itself, the problems of `rig.bench.problems`, and pairs.

    Parameters
    ----------
    quick
        Without chains of more than a thousand rods, and with few problems.
    """
    say("each quantity by itself …")
    cases = [of_fall(scene) for scene in alone() if not quick or len(scene.masses) <= _MANY]
    for make, ends in ((contact, CONTACTS_S), (beam_fit, BANDS_M), (fall_time, KAPPAS)):
        cases += [make(end) for end in ends[:: 4 if quick else 1]]
    rows = [row for case in cases for row in examine(case)]
    say("every two together …")
    return rows + [row for scene in pairs() for row in examine(of_fall(scene))]


def examine(case: WorkProblem) -> list[StabilityRow]:
    """Compare our method of a problem with true values, quantity by quantity.

    A warning counts as a failure.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values, _, note = case.best(case.ours)
        except (RigError, ArithmeticError, ValueError, Warning) as fault:
            verdict, words = "FAILED", f"{type(fault).__name__}: {fault}"
            if isinstance(fault, DomainError):
                verdict, words = "refused", fault.message
            return [StabilityRow(case.title, "", None, 0.0, 0.0, 0.0, None, "–", verdict, words)]
    try:
        naive, end = case.best(case.naive).values, ""
    except (RigError, ArithmeticError) as fault:
        naive, end = {}, type(fault).__name__
    rows = []
    for name, exact, condition in _conditions(case):
        error, expected = relative_error(values[name], exact), case.unit * max(1.0, condition)
        plain = relative_error(naive[name], exact) if naive else None
        verdict = "FAILED" if error > case.slack * expected else "noted" if note else "exact"
        rows.append(StabilityRow(
            case.title, name, error, condition, expected, error / max(1.0, condition), plain,
            end if plain is None else f"{plain:.0e}", verdict, note,
        ))  # fmt: skip
    return rows


def _conditions(case: WorkProblem) -> list[tuple[str, Decimal, float]]:
    """Return each quantity, its true value and its condition."""
    conditions = []
    with references.many_digits():
        nudged = [
            case.exact(**{**case.inputs, name: Decimal(value) * (1 + _NUDGE)})
            for name, value in case.inputs.items()
        ]
        for name, exact in case.exact(**case.inputs).items():
            changes = [float(abs(near[name] / exact - 1) / _NUDGE) for near in nudged if exact]
            conditions.append((name, exact, sum(changes, 0.0)))
    return conditions


def of_fall(scene: Extreme) -> WorkProblem:
    """Return the fall of a scene; of a long chain the condition is taken to be 1."""
    rods = len(scene.masses)
    return WorkProblem(
        scene.name, scene.name, scene.inputs if rods <= _MANY else {},
        lambda **inputs: scene.exact({**scene.inputs, **inputs}), "legs in closed form",
        [direct("rig", scene.predict), direct("as printed", scene.as_printed)],
        "rig", "as printed", slack=SLACK * math.sqrt(rods),
    )  # fmt: skip
