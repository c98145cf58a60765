"""What is known of a fall before the chain is let go: that it cannot be, or how long it takes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .compiled import is_compiled
from .fall import AFTER, skip, usual_step
from .hanging import gaps, hang
from .motion import LONGEST, SAMPLE, closest

if TYPE_CHECKING:
    from .scene import Chain

MOST_ROD_STEPS = 1e8
"""Rods times steps of the longest fall that is made: less than a minute, and half a gigabyte."""
_EACH_STEP_S, _EACH_ROD_S, _EACH_PAIR_S = 1e-6, 7e-8, 1e-10
"""Of a step, of each rod in it and of each pair of rods, in compiled loops of a usual computer."""
_GRID_S = 1e-4  # a step in which it is found out how far a chain falls by a formula
_NOT_COMPILED_S = 23e-6
"""Of each rod in a step where loops are not compiled."""


def impossible(chain: Chain) -> str | None:
    """Say why a chain cannot hang or land like this, if so."""
    world = hang(chain)
    for k in range(world.bodies.mass.size - 1 if chain.touching is not None else 0):
        if closest(world.bodies, k, k + 1)[0] > 0.0:
            return f"rods {k + 1} and {k + 2} are in each other as it hangs"
    if chain.board is not None:
        lowest = gaps(world)
        if lowest.min() <= 0.0:
            return f"rod {int(lowest.argmin()) + 1} is in the board as it hangs"
    needed = duration(chain)
    if needed > LONGEST:
        return f"its top rod needs {needed:.3g} s to the contact level, more than {LONGEST:g} s"
    return None


def duration(chain: Chain) -> float:
    """How long a chain would fall until its top rod is at the contact level and a little on, s."""
    distance = max(0.0, chain.start + float(chain.rods.heights[-1]))
    kappa = 0.0 if chain.drag is None else float(chain.drag.max())
    if kappa == 0.0:
        return math.sqrt(2.0 * distance / chain.gravity) + AFTER
    # From v' = g − κv²: cosh(t √(gκ)) = exp(κ way), of which the exponential may be too large.
    growth = kappa * distance
    stretched = growth + math.log1p(math.sqrt(-math.expm1(-2.0 * growth)))
    return stretched / math.sqrt(chain.gravity * kappa) + AFTER


def rod_steps(chain: Chain) -> float:
    """Rods times steps of a fall, without what of it goes by a formula."""
    by_formula = skip(chain, hang(chain), _GRID_S).size * SAMPLE * _GRID_S
    return chain.rods.masses.size * max(0.0, duration(chain) - by_formula) / usual_step(chain)


def processor_time(chain: Chain) -> float:
    """Roughly how long a fall takes to make, s."""
    rods, steps = chain.rods.masses.size, rod_steps(chain)
    if not is_compiled():
        return steps * _NOT_COMPILED_S
    return steps / rods * (_EACH_STEP_S + rods * (_EACH_ROD_S + rods * _EACH_PAIR_S))
