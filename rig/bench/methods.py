"""The methods of the precision benchmark, each with the settings over which it is swept.

Every setting has a fall of its own for the gate: the chain cut off where the top rod passes it, so
that what is timed is Δz and V and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from scipy.integrate import solve_ivp

from rig.bench.precision_reference import GATE_M, Model, PrecisionScene
from rig.errors import RigError
from rig.model import continuum
from rig.model.chain import Chain
from rig.model.fall import fall, hits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    Stage = tuple[float, ...]
    Slope = Callable[[Stage], Stage]
    Advance = Callable[[Slope, Stage, float], Stage]
    Body = tuple[Chain, Sequence[float]]

Solver = Literal["RK45", "DOP853", "Radau", "BDF", "LSODA"]
SOLVERS: tuple[Solver, ...] = get_args(Solver)
IMPLICIT: frozenset[Solver] = frozenset({"Radau", "BDF", "LSODA"})
EVALUATION_BUDGET, QUICK_BUDGET = 60_000, 30_000
"""Evaluations that all legs of a fall may take; the latter in a quick sweep."""
CONTACT_RTOL = 1e-6
ABSOLUTE = 1e-3
"""Absolute tolerance (m, m/s) per relative one, leg by leg."""

_TOLERANCES = tuple(10.0**-n for n in range(2, 14))
_STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
_GAUSS = (2, 3, 4, 6, 8, 12, 16, 24)
_QUICK_TOLERANCES = (1e-3, 1e-6, 1e-9)
_QUICK_STEPS = (1e-2, 1e-3)
_QUICK_SOLVERS: tuple[Solver, ...] = ("RK45", "LSODA")
_MANY_RODS = 1000


@dataclass(frozen=True, slots=True)
class Answer:
    """What a method finds.

    Attributes
    ----------
    separation_m
        Δz; `None` from a method that gives V alone.
    speed_m_s, time_s
        V, and the time to get there; the latter `None` where it is not worked out.
    evaluations
        Of the right-hand side or the integrand; legs, where each is solved in closed form.
    steps
        Steps, nodes or legs.
    """

    separation_m: float | None
    speed_m_s: float
    time_s: float | None
    evaluations: int
    steps: int


@dataclass(frozen=True, slots=True)
class Setting:
    """A method with its parameter.

    Attributes
    ----------
    text
        For people.
    value
        Tolerance, step (s), number of nodes or contact time (s).
    solve
        The fall to the end.
    gate
        The fall to where the top rod passes the gate; `None` if the method knows no time.
    contact_time_s
        τ of the model solved; `None` for impacts that take no time.
    """

    text: str
    value: float
    solve: Callable[[], Answer]
    gate: Callable[[], Answer] | None
    contact_time_s: float | None = None


@dataclass(frozen=True, slots=True)
class Method:
    """One line of the picture.

    Attributes
    ----------
    settings
        Cheapest first.
    """

    name: str
    model: Model
    settings: tuple[Setting, ...]


def methods(scene: PrecisionScene, *, quick: bool = False) -> list[Method]:
    """Every method that applies to a scene.

    Parameters
    ----------
    quick
        A few settings of a few methods.
    """
    return [
        *_discrete(scene, quick=quick),
        *_continuum(scene, quick=quick),
        *_contact(scene, quick=quick),
    ]


def absent(scene: PrecisionScene) -> list[tuple[str, str]]:
    """What does not apply to a scene: method and reason."""
    left_out = []
    if not scene.even:
        reason = "Eq. 14 holds for like rods at equal distances"
        left_out.append(("continuum, every method", reason))
    if scene.chain.rods > _MANY_RODS:
        reason = (
            f"a solver started afresh for each of {scene.chain.rods} legs takes 30,000 evaluations "
            "and more, many seconds a fall, at any tolerance"
        )
        left_out += [
            (f"{kind} {solver}", reason) for kind in ("legs", "contact") for solver in SOLVERS
        ]
    return left_out


def _solvers(scene: PrecisionScene, *, quick: bool) -> tuple[Solver, ...]:
    if scene.chain.rods > _MANY_RODS:
        return ()
    return _QUICK_SOLVERS if quick else SOLVERS


def _bodies(scene: PrecisionScene) -> tuple[Body, Body]:
    """The whole chain and the one cut off at the gate, with the gains of their impacts."""
    return (scene.chain, scene.gains), cut_at_gate(scene.chain, scene.gains)


def _swept(
    name: str,
    model: Model,
    solve: Callable[[Any, float], Answer],
    bodies: tuple[Any, Any],
    values: Sequence[float],
    text: str,
) -> Method:
    """A method over its parameter, each value for the whole chain and as far as the gate."""
    return Method(
        name,
        model,
        tuple(
            Setting(
                text.format(value),
                value,
                partial(solve, bodies[0], value),
                partial(solve, bodies[1], value),
                value if model == "contact" else None,
            )
            for value in values
        ),
    )


def _discrete(scene: PrecisionScene, *, quick: bool) -> Iterator[Method]:
    chain, where = scene.chain, (scene.drop, scene.gravity)
    bodies = _bodies(scene)
    steps = _QUICK_STEPS if quick else _STEPS
    tolerances = _QUICK_TOLERANCES if quick else _TOLERANCES

    def direct() -> Answer:
        end = fall(chain, scene.alpha, scene.gamma, *where)
        return Answer(end.separation_m, end.speed_m_s, end.time_s, chain.rods, chain.rods)

    def gate() -> Answer:
        last = hits(*bodies[1], *where)[-1]
        return Answer(None, last.speed_before, last.time_s, chain.rods, chain.rods)

    def fixed_steps(advance: Advance, body: Body, step: float) -> Answer:
        return step_by_step(*body, *where, step, advance)

    def with_solver(solver: Solver, body: Body, rtol: float) -> Answer:
        return leg_by_leg(*body, *where, solver, rtol)

    yield Method("discrete event-exact", "discrete", (Setting("–", 0.0, direct, gate),))
    for solver in _solvers(scene, quick=quick):
        solve = partial(with_solver, solver)
        yield _swept(f"legs {solver}", "discrete", solve, bodies, tolerances, "rtol {:.0e}")
    for name, advance in (("Euler", euler), ("RK4", rk4)):
        solve = partial(fixed_steps, advance)
        yield _swept(f"fixed-step {name}", "discrete", solve, bodies, steps, "step {:.0e} s")


def _continuum(scene: PrecisionScene, *, quick: bool) -> Iterator[Method]:
    """Closed form and quadrature."""
    if not scene.even:
        return
    reach = scene.gamma * scene.spacing_m
    rest = (scene.alpha, 1.0, scene.drop, scene.gravity)
    uncut = continuum.UniformChain(scene.chain.length, reach, *rest)
    # Lower by the gate's height, z + γs and z₀ + γs are the same: so is the fall as far as there.
    cut = continuum.UniformChain(scene.chain.length - GATE_M, reach + GATE_M, *rest)

    def eq14() -> Answer:
        return Answer(None, continuum.speed(uncut, 0.0), None, 1, 1)

    def gauss(chain: continuum.UniformChain, nodes: float) -> Answer:
        end = continuum.end(chain, nodes=int(nodes))
        return Answer(end.separation_m, end.speed_m_s, end.time_s, end.evaluations, int(nodes))

    yield Method("continuum Eq. 14", "continuum", (Setting("–", 0.0, eq14, None),))
    counts = _GAUSS[::3] if quick else _GAUSS
    name = "continuum Gauss–Legendre"
    yield _swept(name, "continuum", gauss, (uncut, cut), counts, "{:.0f} nodes")


def _contact(scene: PrecisionScene, *, quick: bool) -> Iterator[Method]:
    """Impacts that last: the stiff form of the discrete fall."""
    budget = QUICK_BUDGET if quick else EVALUATION_BUDGET
    taus = scene.contact_times[:2] if quick else scene.contact_times
    where = scene.drop, scene.gravity

    def with_solver(solver: Solver, body: Body, tau: float) -> Answer:
        return leg_by_leg(*body, *where, solver, CONTACT_RTOL, tau, budget=budget)

    for solver in _solvers(scene, quick=quick):
        solve = partial(with_solver, solver)
        yield _swept(f"contact {solver}", "contact", solve, _bodies(scene), taus, "τ {:.0e} s")


def cut_at_gate(chain: Chain, gains: Sequence[float]) -> tuple[Chain, list[float]]:
    """The chain as far as it has struck when its top rod passes the gate, with a last rod there.

    The masses mean nothing any more; the gains stand for them.
    """
    end = chain.length - GATE_M
    struck = [height for height in chain.heights if height < end]
    masses = (1.0,) * (len(struck) + 1)
    return Chain(masses, (*struck, end)), [*gains[: len(struck)], 0.0]


def leg_by_leg(
    chain: Chain,
    gains: Sequence[float],
    drop: float,
    gravity: float,
    solver: Solver,
    rtol: float,
    contact_time: float | None = None,
    *,
    budget: int = EVALUATION_BUDGET,
) -> Answer:
    """Integrate height z, speed v, Δz and the speed gained u from impact to impact, each an event.

    An impact that lasts does not act at once but through a critically damped response: the pull is
    ΔV · (t/τ'²) · exp(−t/τ') with τ' = τ/2, so that τ is its mean delay and the whole of it is ΔV
    (Eq. 9). With p and q its two stages,

        z' = −v,   v' = g + p/τ',   Δz' = u,   u' = p/τ',   p' = (q − p)/τ',   q' = −q/τ',

    linear, with the eigenvalue −1/τ' twice: an explicit solver must take steps of the order of τ.

    Parameters
    ----------
    chain, gains, drop, gravity
        As in `rig.model.fall.hits`.
    solver, rtol
        Of `scipy.integrate.solve_ivp`; the absolute tolerance is `ABSOLUTE` of it in m and m/s. The
        implicit ones are given the Jacobian.
    contact_time
        τ, s; `None` for impacts that take no time.
    budget
        Evaluations that all legs together may take.

    Raises
    ------
    RigError
        When the budget is spent, or the solver gives up.
    """
    matrix = np.zeros((6, 6))
    matrix[0, 1], matrix[2, 3] = -1.0, 1.0
    if contact_time is None:
        matrix, struck = matrix[:4, :4], [1, 3]
    else:
        matrix[[1, 3, 4, 4, 5], [4, 4, 4, 5, 5]] = np.array([1, 1, -1, 1, -1]) * (
            2.0 / contact_time
        )
        struck = [5]
    state, falling = np.zeros(len(matrix)), np.zeros(len(matrix))
    state[0], falling[1] = drop, gravity
    options: dict[str, Any] = {"jac": lambda _time, _state: matrix} if solver in IMPLICIT else {}
    evaluations = steps = 0
    time = 0.0

    def slope(_time: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        nonlocal evaluations
        evaluations += 1
        if evaluations > budget:
            raise RigError(f"more than {budget} evaluations, and the chain is not down yet")
        return matrix @ state + falling

    for height, gain in zip(chain.heights, gains, strict=True):
        speed, distance = float(state[1]), float(state[0]) + height
        # No leg is longer than that of a free fall.
        longest = 2.0 * distance / (speed + (speed * speed + 2.0 * gravity * distance) ** 0.5)
        run = solve_ivp(
            slope,
            (time, time + 2.0 * longest),
            state,
            method=solver,
            events=_Landing(height),
            rtol=rtol,
            atol=ABSOLUTE * rtol,
            **options,
        )
        if run.status != 1:
            raise RigError(f"{solver}: {run.message}")
        state, time = run.y[:, -1].copy(), float(run.t[-1])
        steps += run.t.size - 1
        arrival = float(state[1])
        state[struck] += arrival * gain
    return Answer(float(state[2]), arrival, time, evaluations, steps)


class _Landing:
    """The event that a rod strikes."""

    terminal = True
    direction = -1.0

    def __init__(self, height: float) -> None:
        self.height = height

    def __call__(self, _time: float, state: NDArray[np.float64]) -> float:
        return float(state[0]) + self.height


def step_by_step(
    chain: Chain, gains: Sequence[float], drop: float, gravity: float, step: float, advance: Advance
) -> Answer:
    """Fall as in a spreadsheet: a row a step, the end being the first row past the contact point.

    An impact is applied at the end of the step in which the rod passes the contact point.

    Parameters
    ----------
    step
        s.
    advance
        `euler` or `rk4`.
    """
    targets = [drop + height for height in chain.heights]
    state: Stage = (0.0, 0.0, 0.0, 0.0)  # way fallen, speed, Δz, speed gained

    def slope(state: Stage) -> Stage:
        return state[1], gravity, state[3], 0.0

    rows = struck = 0
    while True:
        state = advance(slope, state, step)
        rows += 1
        while state[0] >= targets[struck]:
            fallen, speed, separation, gained = state
            struck += 1
            if struck == len(targets):
                evaluations = rows * (1 if advance is euler else 4)
                return Answer(separation, speed, rows * step, evaluations, rows)
            kick = speed * gains[struck - 1]
            state = (fallen, speed + kick, separation, gained + kick)


def euler(slope: Slope, state: Stage, step: float) -> Stage:
    """One step of Euler's method."""
    return tuple([y + step * k for y, k in zip(state, slope(state), strict=True)])


def rk4(slope: Slope, state: Stage, step: float) -> Stage:
    """One step of the classical Runge–Kutta method."""
    k1 = slope(state)
    two = slope(tuple([y + 0.5 * step * k for y, k in zip(state, k1, strict=True)]))
    three = slope(tuple([y + 0.5 * step * k for y, k in zip(state, two, strict=True)]))
    four = slope(tuple([y + step * k for y, k in zip(state, three, strict=True)]))
    return tuple(
        [
            y + step / 6.0 * (a + 2.0 * (b + c) + d)
            for y, a, b, c, d in zip(state, k1, two, three, four, strict=True)
        ]
    )
