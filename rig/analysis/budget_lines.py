"""Lines of the uncertainty budget, from ``budget_lines.txt``, and effective degrees of freedom."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from rig.protocol.protocol import GUESSED
from rig.text_rows import read_rows


class BudgetLine(NamedTuple):
    """Properties of a line of the uncertainty budget.

    Attributes
    ----------
    common
        Whether the error is the same in every run, so that averaging does not reduce it.
    guessed
        Whether its size is an assumption, unless a joint fit estimates it.
    scale
        Variance component that a joint fit estimates, and whose degrees of freedom the line has.
    known
        Input that could be measured better, with the protocol's key; empty if there is none.
    """

    common: bool
    guessed: bool
    scale: str
    known: str


BUDGET = {
    name: BudgetLine("common" in kinds, "guessed" in kinds, scale, known)
    for name, kinds, scale, known in read_rows(__file__)
}
COMMON = tuple(name for name, line in BUDGET.items() if line.common)


def largest_first(parts: Mapping[str, float]) -> dict[str, float]:
    """Return contributions, the largest first; what differs by rounding alone keeps its order."""
    return dict(sorted(parts.items(), key=lambda part: -float(f"{part[1]:.6g}")))


def effective_degrees(u: float, budget: Mapping[str, float], degrees: Mapping[str, float]) -> float:
    """Return the effective degrees of freedom by Welch–Satterthwaite (GUM G.4); at least 1.

    Parameters
    ----------
    budget
        Lines whose squares add up to that of `u`.
    degrees
        Degrees of freedom of lines; `GUESSED` for other guessed lines, infinite for the rest.
    """
    share = sum(
        (line / u) ** 4 / degrees.get(name, GUESSED)
        for name, line in budget.items()
        if name in degrees or BUDGET[name].guessed
    )
    return max(1.0, 1.0 / share) if share > 0.0 else math.inf
