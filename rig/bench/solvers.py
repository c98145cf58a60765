"""General solvers on falls: SciPy's, with events.

All are given the same equations, locate impacts by the same event and take tolerances alike; the
implicit ones have the Jacobian.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from scipy.integrate import solve_ivp

from rig.arrays import Array
from rig.bench.work import Answer
from rig.errors import RigError

Solver = Literal["RK45", "DOP853", "Radau", "BDF", "LSODA"]
SOLVERS: tuple[Solver, ...] = get_args(Solver)
IMPLICIT: frozenset[Solver] = frozenset({"Radau", "BDF", "LSODA"})
ABSOLUTE = 1e-3
"""Absolute tolerance (m, m/s) per relative one."""
BUDGET = 60_000
"""Evaluations that all legs of a fall may take."""
LONGEST_S = 5.0
"""More than any leg takes."""
HEIGHT, SPEED, SEPARATION, GAINED, PULL = range(5)
"""Places in a state: height of the bottom rod, m, downward speed, Δz, the speed gained, and what
lasting impacts still pull."""
_TINY = 2.0**-300
"""Of a state, whose square does not count beside it."""


class Legs(NamedTuple):
    """A fall as first-order equations between impacts.

    Attributes
    ----------
    start
        State at release.
    heights, gains
        Of each rod above the bottom rod, m, and what its impact adds: ΔV/V, or to the pull where
        the state has one.
    slope
        At a state, analytic: it is also taken at complex ones.
    begin_s
        Time of `start`.
    """

    start: Sequence[float]
    heights: Sequence[float]
    gains: Sequence[float]
    slope: Callable[[Array], Array]
    begin_s: float = 0.0

    def jacobian(self, _: float, y: Array) -> Array:
        """Return the slope's derivatives at a state, to a rounding: by tiny imaginary steps."""
        steps = 1j * _TINY * np.eye(y.size)
        return np.column_stack([self.slope(y + step).imag for step in steps]) / _TINY


def in_air(
    heights: Sequence[float], gains: Sequence[float], kappa: float, drop: float, gravity: float
) -> Legs:
    """Return a fall of both chains in the same air: v' = g − κv²."""

    def slope(y: Array) -> Array:
        _, v, _, u = y
        return np.array([-v, gravity - kappa * v * v, u, -kappa * u * (2.0 * v - u)])

    return Legs([drop, 0.0, 0.0, 0.0], heights, gains, slope)


def lasting_impacts(
    heights: Sequence[float], gains: Sequence[float], drop: float, gravity: float, contact_s: float
) -> Legs:
    """Return a fall whose impacts last: a pull in proportion to the speed that dies away with τ.

    v' = g + wv/τ and w' = −w/τ, to whose w an impact adds ln(1 + ΔV/V): as τ → 0 it is Eq. 9, and
    an explicit solver must take steps of the order of τ.
    """

    def slope(y: Array) -> Array:
        pull = y[PULL] * y[SPEED] / contact_s
        return np.array([-y[SPEED], gravity + pull, y[GAINED], pull, -y[PULL] / contact_s])

    return Legs([drop, 0.0, 0.0, 0.0, 0.0], heights, [math.log1p(gain) for gain in gains], slope)


def folding(length: float, reach: float, alpha: float, drop: float, gravity: float) -> Legs:
    """Return the fold of a continuous chain: v' = g + αv²/(z + γs) from Eqs. 1 and 11.

    Parameters
    ----------
    reach
        γs, m.
    """
    speed = math.sqrt(2.0 * gravity * drop)

    def slope(y: Array) -> Array:
        pull = alpha * y[SPEED] * y[SPEED] / (y[HEIGHT] + reach)
        return np.array([-y[SPEED], gravity + pull, y[GAINED], pull])

    return Legs([length, speed, 0.0, 0.0], [0.0], [0.0], slope, begin_s=speed / gravity)


def solve(legs: Legs, solver: Solver, rtol: float) -> Answer:
    """Integrate from impact to impact, each an event of `scipy.integrate.solve_ivp`.

    Raises
    ------
    RigError
        When `BUDGET` is spent, or the solver gives up.
    """
    state, time, arrival = np.array(legs.start), legs.begin_s, 0.0
    evaluations = 0
    options: dict[str, Any] = {"jac": legs.jacobian} if solver in IMPLICIT else {}
    options |= {"method": solver, "rtol": rtol, "atol": ABSOLUTE * rtol}

    def slope(_: float, y: Array) -> Array:
        nonlocal evaluations
        evaluations += 1
        if evaluations > BUDGET:
            raise RigError(f"more than {BUDGET} evaluations, and the chain is not down yet")
        return legs.slope(y)

    for height, gain in zip(legs.heights, legs.gains, strict=True):

        def landing(_: float, y: Array, height: float = height) -> float:
            return float(y[HEIGHT] + height)

        landing.terminal, landing.direction = True, -1.0  # type: ignore[attr-defined]  # SciPy's
        run = solve_ivp(slope, (time, time + LONGEST_S), state, events=landing, **options)
        if run.status != 1:
            raise RigError(f"{solver}: {run.message}")
        state, time = run.y[:, -1].copy(), float(run.t[-1])
        arrival = float(state[SPEED])
        if len(state) > PULL:
            state[PULL] += gain
        else:
            state[[SPEED, GAINED]] += arrival * gain
    separation = float(state[SEPARATION])
    return Answer({"separation": separation, "speed": arrival, "time": time}, evaluations)
