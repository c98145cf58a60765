"""Impacts that last, by a general solver: the stiff problem of `rig.model.contact` in numbers.

Between impacts the state (Δz, what is gained in speed, τ'a₂, τ'a₁) follows

    Δz' = u,   u' = p/τ',   p' = (q − p)/τ',   q' = −q/τ',

linear, with the eigenvalue −1/τ' twice. Free fall is no part of what is stiff and is added in
closed form; with Δz a state of its own, the relative tolerance holds for it however small α is.
A leg ends at the event that the next rod strikes, and the next one starts afresh with q raised by
ΔV. scipy is half a second to load, and so no prediction imports this.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from scipy.integrate import solve_ivp

from rig.errors import DomainError, RigError
from rig.model.contact import check_contact
from rig.model.fall import Fall

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from rig.model.chain import Chain

    Event = Callable[[float, NDArray[np.float64]], float]

Method = Literal["RK45", "DOP853", "Radau", "BDF", "LSODA"]
METHODS: tuple[Method, ...] = get_args(Method)
IMPLICIT: frozenset[Method] = frozenset({"Radau", "BDF", "LSODA"})
STEP_BUDGET = 100_000
_TIGHTEST = 100.0 * float(np.finfo(float).eps)  # rtol below which scipy sets its own


class StepBudgetError(RigError):
    """The solver has taken all the steps it may and the chain is not down yet."""


class SolverError(RigError):
    """The solver gave up."""


@dataclass(frozen=True, slots=True)
class Integration:
    """A fall by a general solver, and what it took.

    Attributes
    ----------
    nfev, njev
        Evaluations of the right-hand side and of its Jacobian.
    steps
        Steps taken, over all legs.
    """

    fall: Fall
    nfev: int
    njev: int
    steps: int


def integrate_contact(
    chain: Chain,
    gains: Sequence[float],
    drop: float,
    gravity: float,
    contact_time: float,
    initial_speed: float = 0.0,
    *,
    method: Method = "Radau",
    rtol: float = 1e-8,
    atol: float = 1e-12,
    step_budget: int = STEP_BUDGET,
) -> Integration:
    """Δz, V and t as `rig.model.contact.contact_fall`, integrated step by step.

    Parameters
    ----------
    chain, gains, drop, gravity, contact_time, initial_speed
        As in `rig.model.contact.contact_fall`.
    method
        Of `scipy.integrate.solve_ivp`. The implicit ones are given the Jacobian.
    rtol, atol
        Tolerances of a step: relative, and absolute in m and m/s.
    step_budget
        Steps that all legs together may take.

    Raises
    ------
    DomainError
        As `contact_fall`; for an unknown method, and for tolerances that cannot be kept.
    StepBudgetError
        When the budget is spent: an explicit method must take steps of the order of τ all the way.
    SolverError
        When the solver itself gives up.
    """
    check_contact(gains, contact_time)
    if method not in METHODS:
        raise DomainError(f"no method {method!r}", f"one of {', '.join(METHODS)}")
    if not (_TIGHTEST <= rtol < 1.0 and 0.0 <= atol < math.inf):
        raise DomainError(
            f"tolerances rtol {rtol:g}, atol {atol:g}",
            f"rtol must be at least {_TIGHTEST:.2g} and below 1, atol not negative",
        )
    rate = 2.0 / contact_time
    matrix = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, rate, 0.0],
            [0.0, 0.0, -rate, rate],
            [0.0, 0.0, 0.0, -rate],
        ]
    )

    def slope(_time: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        return matrix @ state

    tally = _Tally(step_budget, method, contact_time)
    # An explicit method would warn that it has no use for the Jacobian.
    options: dict[str, Any] = {"jac": lambda _time, _state: matrix} if method in IMPLICIT else {}
    state = np.zeros(4)
    time, free_speed, before = 0.0, initial_speed, -drop
    nfev = njev = 0
    for height, gain in zip(chain.heights, gains, strict=True):
        distance = height - before
        before = height
        if distance > 0.0:
            lands = _landing(distance, free_speed, gravity, state)
            tally.new_leg()
            run = solve_ivp(
                slope,
                (0.0, 2.0 * _free_time(distance, free_speed + float(state[1]), gravity)),
                state,
                method=method,
                events=[lands, tally],
                rtol=rtol,
                atol=atol,
                **options,
            )
            if run.status != 1:
                raise SolverError(f"{method}: {run.message}", "try another method or tolerance")
            duration = float(run.t[-1])
            state = run.y[:, -1].copy()
            nfev += run.nfev
            njev += run.njev
            time += duration
            free_speed += gravity * duration
        arrival = free_speed + float(state[1])
        state[3] += arrival * gain
    return Integration(Fall(float(state[0]), arrival, time), nfev, njev, tally.steps)


def _landing(
    distance: float, free_speed: float, gravity: float, start: NDArray[np.float64]
) -> Event:
    """Height of the next rod above the surface, which ends the leg where it comes down to zero."""
    separation = float(start[0])

    def above(time: float, state: NDArray[np.float64]) -> float:
        fallen = (free_speed + 0.5 * gravity * time) * time
        return distance - fallen - (float(state[0]) - separation)

    above.terminal = True  # type: ignore[attr-defined]
    above.direction = -1.0  # type: ignore[attr-defined]
    return above


def _free_time(distance: float, speed: float, gravity: float) -> float:
    """Time of a leg that nothing pulls on: no leg is longer."""
    arrival = math.sqrt(speed * speed + 2.0 * gravity * distance)
    if arrival == 0.0:
        raise DomainError("the chain never falls: no gravity and no initial speed")
    return 2.0 * distance / (speed + arrival)


class _Tally:
    """An event that never comes: the solver asks for it at the start of a leg and at every step."""

    def __init__(self, budget: int, method: Method, contact_time: float) -> None:
        self.steps = 0
        self._budget = budget
        self._method = method
        self._contact_time = contact_time

    def new_leg(self) -> None:
        """The next question is about a start and not about a step."""
        self.steps -= 1

    def __call__(self, _time: float, _state: NDArray[np.float64]) -> float:
        self.steps += 1
        if self.steps > self._budget:
            hint = "loosen rtol, or allow more steps"
            if self._method not in IMPLICIT:
                hint = (
                    "an explicit method goes about one contact time at a step, here "
                    f"{self._contact_time:g} s: take Radau, BDF or LSODA, or allow more steps"
                )
            raise StepBudgetError(
                f"{self._method} took {self._budget} steps and the chain is not down yet", hint
            )
        return 1.0
