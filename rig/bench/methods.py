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

from rig.bench.precision_reference import GATE_M
from rig.errors import RigError
from rig.model import continuum, density_ode
from rig.model.chain import Chain
from rig.model.contact import contact_fall
from rig.model.contact_ode import IMPLICIT, integrate_contact
from rig.model.density import Uniform
from rig.model.fall import fall, hits
from rig.model.motion import Motion

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from rig.bench.precision_reference import Model, PrecisionScene
    from rig.model.density import Density

    Stage = tuple[float, ...]
    Slope = Callable[[Stage], Stage]
    Advance = Callable[[Slope, Stage, float], Stage]

Solver = Literal["RK45", "DOP853", "Radau", "BDF", "LSODA"]
SOLVERS: tuple[Solver, ...] = get_args(Solver)
EVALUATION_BUDGET = 60_000
"""Evaluations of the right-hand side that all legs of one fall may take."""
CONTINUUM_LIMIT = 5_000
"""After a setting that took more evaluations than this, tighter ones are left out."""
STEP_BUDGET, QUICK_STEP_BUDGET = 10_000, 5_000
"""Steps that one fall with impacts that last may take, in all and in a quick sweep."""
CONTACT_RTOL, CONTACT_ATOL = 1e-6, 1e-10
ABSOLUTE = 1e-3
"""Absolute tolerance (m, m/s) per relative one, leg by leg."""

_TOLERANCES = tuple(10.0**-n for n in range(2, 14))
_STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
_GAUSS = (2, 3, 4, 6, 8, 12, 16, 24)
_END_RULE = (11, 21, 31, 41, 61, 81, 121, 161)
_QUICK_TOLERANCES = (1e-3, 1e-6, 1e-9)
_QUICK_STEPS = (1e-2, 1e-3)
_QUICK_SOLVERS: tuple[Solver, ...] = ("RK45", "LSODA")
_SOLVED_CONTACTS = (1e-2, 1e-4, 1e-6, 1e-9)
_MANY_RODS = 1000


class BudgetError(RigError):
    """A method would take longer than the sweep has time for."""


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
    limit
        Evaluations after which the settings that follow are left out.
    """

    name: str
    model: Model
    settings: tuple[Setting, ...]
    limit: int | None = None


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
    gone = []
    if scene.density is None:
        reason = "the rods are not evenly spaced, and Eq. 11 has one s for all"
        gone.append(("continuum, every method", reason))
    elif not isinstance(scene.density, Uniform):
        reason = "holds for an even density only"
        gone += [
            (name, reason)
            for name in ("continuum Eq. 14", "continuum Gauss–Legendre", "continuum tanh–sinh")
        ]
    if scene.chain.rods > _MANY_RODS:
        reason = (
            f"a solver started afresh for each of {scene.chain.rods} legs takes 30,000 evaluations "
            "and more, many seconds a fall, at any tolerance"
        )
        gone += [(f"{kind} {solver}", reason) for kind in ("legs", "contact") for solver in SOLVERS]
    return gone


def _discrete(scene: PrecisionScene, *, quick: bool) -> Iterator[Method]:
    chain, gains, drop, gravity = scene.chain, scene.gains, scene.drop, scene.gravity
    cut, cut_gains = cut_at_gate(chain, gains)

    def direct() -> Answer:
        end = fall(chain, scene.alpha, scene.gamma, drop, gravity)
        return Answer(end.separation_m, end.speed_m_s, end.time_s, chain.rods, chain.rods)

    def whole_motion() -> Answer:
        motion = Motion(chain, gains, drop, gravity)
        end = motion.at(motion.end_s)
        return Answer(end.separation_m, end.speed_m_s, end.time_s, chain.rods, chain.rods)

    def gate() -> Answer:
        last = hits(cut, cut_gains, drop, gravity)[-1]
        return Answer(None, last.speed_before, last.time_s, cut.rods, cut.rods)

    exact = "event-exact"
    yield Method(f"discrete {exact}", "discrete", (Setting("–", 0.0, direct, gate),))
    yield Method("discrete whole motion", "discrete", (Setting("–", 0.0, whole_motion, gate),))
    solvers = _QUICK_SOLVERS if quick else SOLVERS
    for solver in () if chain.rods > _MANY_RODS else solvers:
        yield Method(
            f"legs {solver}",
            "discrete",
            tuple(
                Setting(
                    f"rtol {rtol:.0e}",
                    rtol,
                    partial(leg_by_leg, chain, gains, drop, gravity, solver, rtol),
                    partial(leg_by_leg, cut, cut_gains, drop, gravity, solver, rtol),
                )
                for rtol in (_QUICK_TOLERANCES if quick else _TOLERANCES)
            ),
        )
    advances: tuple[tuple[str, Advance], ...] = (("Euler", euler), ("RK4", rk4))
    for name, advance in advances:
        yield Method(
            f"fixed-step {name}",
            "discrete",
            tuple(
                Setting(
                    f"step {step:.0e} s",
                    step,
                    partial(step_by_step, chain, gains, drop, gravity, step, advance),
                    partial(step_by_step, cut, cut_gains, drop, gravity, step, advance),
                )
                for step in (_QUICK_STEPS if quick else _STEPS)
            ),
        )


def _continuum(scene: PrecisionScene, *, quick: bool) -> Iterator[Method]:
    if scene.density is None:
        return
    if isinstance(scene.density, Uniform):
        yield from _even(scene, scene.density, quick=quick)
    cut = _CutDensity(scene.density, GATE_M)
    for solver in _QUICK_SOLVERS if quick else SOLVERS:
        yield Method(
            f"continuum {solver}",
            "continuum",
            tuple(
                Setting(
                    f"rtol {rtol:.0e}",
                    rtol,
                    partial(_integrated, scene, scene.density, solver, rtol),
                    partial(_integrated, scene, cut, solver, rtol),
                )
                for rtol in (_QUICK_TOLERANCES if quick else _TOLERANCES)
            ),
            CONTINUUM_LIMIT,
        )


def _even(scene: PrecisionScene, density: Uniform, *, quick: bool) -> Iterator[Method]:
    """Closed form and quadratures."""
    reach = scene.gamma * scene.spacing_m
    rest = (scene.alpha, 1.0, scene.drop, scene.gravity)
    whole = continuum.UniformChain(density.length_m, reach, *rest)
    # Lower by the gate's height, z + γs and z₀ + γs are the same: so is the fall as far as there.
    cut = continuum.UniformChain(density.length_m - GATE_M, reach + GATE_M, *rest)

    def eq14() -> Answer:
        return Answer(None, continuum.speed(whole, 0.0), None, 1, 1)

    def gauss(chain: continuum.UniformChain, nodes: int) -> Answer:
        return _ended(continuum.end(chain, nodes=nodes), nodes)

    def end_rule(chain: continuum.UniformChain, nodes: int) -> Answer:
        return _ended(continuum.end_tanh_sinh(chain, nodes=nodes), nodes)

    yield Method("continuum Eq. 14", "continuum", (Setting("–", 0.0, eq14, None),))
    for name, rule, counts in (
        ("Gauss–Legendre", gauss, _GAUSS),
        ("tanh–sinh", end_rule, _END_RULE),
    ):
        yield Method(
            f"continuum {name}",
            "continuum",
            tuple(
                Setting(f"{n} nodes", float(n), partial(rule, whole, n), partial(rule, cut, n))
                for n in (counts[::3] if quick else counts)
            ),
        )


def _ended(end: continuum.ContinuumEnd, nodes: int) -> Answer:
    return Answer(end.separation_m, end.speed_m_s, end.time_s, end.evaluations, nodes)


def _integrated(scene: PrecisionScene, density: Density, solver: Solver, rtol: float) -> Answer:
    end = density_ode.end(
        density,
        scene.alpha,
        scene.gamma,
        scene.spacing_m,
        scene.drop,
        scene.gravity,
        method=solver,
        rtol=rtol,
    )
    return Answer(end.separation_m, end.speed_m_s, end.time_s, end.evaluations, end.steps)


@dataclass(frozen=True, slots=True)
class _CutDensity:
    """What of a density is above a height as the top end comes down to it."""

    whole: Density
    height_m: float

    @property
    def length_m(self) -> float:
        return self.whole.length_m - self.height_m

    def mass_over_density(self, z: float) -> float:
        return self.whole.mass_over_density(z + self.height_m)


def _contact(scene: PrecisionScene, *, quick: bool) -> Iterator[Method]:
    chain, gains = scene.chain, scene.gains
    cut, cut_gains = cut_at_gate(chain, gains)
    fell = (scene.drop, scene.gravity)

    def closed(which: Chain, kicked: Sequence[float], tau: float) -> Answer:
        end = contact_fall(which, kicked, *fell, tau)
        return Answer(end.separation_m, end.speed_m_s, end.time_s, which.rods, which.rods)

    def solved(solver: Solver, which: Chain, kicked: Sequence[float], tau: float) -> Answer:
        done = integrate_contact(
            which,
            kicked,
            *fell,
            tau,
            method=solver,
            rtol=CONTACT_RTOL,
            atol=CONTACT_ATOL,
            step_budget=QUICK_STEP_BUDGET if quick else STEP_BUDGET,
        )
        end = done.fall
        return Answer(end.separation_m, end.speed_m_s, end.time_s, done.nfev, done.steps)

    taus = scene.contact_times[::4] if quick else scene.contact_times
    yield Method("contact closed form", "contact", tuple(
        Setting(f"τ {tau:.0e} s", tau, partial(closed, chain, gains, tau),
                partial(closed, cut, cut_gains, tau), tau)
        for tau in taus
    ))  # fmt: skip
    if scene.chain.rods > _MANY_RODS:
        return
    for solver in _QUICK_SOLVERS if quick else SOLVERS:
        yield Method(f"contact {solver}", "contact", tuple(
            Setting(f"τ {tau:.0e} s, rtol {CONTACT_RTOL:.0e}", tau,
                    partial(solved, solver, chain, gains, tau),
                    partial(solved, solver, cut, cut_gains, tau), tau)
            for tau in taus
 if quick or tau in _SOLVED_CONTACTS
        ))  # fmt: skip


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
    budget: int = EVALUATION_BUDGET,
) -> Answer:
    """Integrate height, speed and Δz from impact to impact, each found as an event.

    Parameters
    ----------
    chain, gains, drop, gravity
        As in `rig.model.fall.hits`.
    solver, rtol
        Of `scipy.integrate.solve_ivp`; the absolute tolerance is `ABSOLUTE` of it in m and m/s.
    budget
        Evaluations that all legs together may take.

    Raises
    ------
    BudgetError
        When it is spent.
    """
    state = np.array([drop, 0.0, 0.0])
    time = gained = arrival = 0.0
    evaluations = steps = 0
    matrix = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    options: dict[str, Any] = {"jac": lambda _time, _state: matrix} if solver in IMPLICIT else {}
    for number, (height, gain) in enumerate(zip(chain.heights, gains, strict=True)):
        speed = float(state[1])
        longest = 2.0 * float(state[0] + height) / (speed or (2.0 * gravity * drop) ** 0.5)
        run = solve_ivp(
            partial(_falling, gravity, gained),
            (time, time + 2.0 * longest),
            state,
            method=solver,
            events=_Landing(height),
            rtol=rtol,
            atol=ABSOLUTE * rtol,
            **options,
        )
        state, time = run.y[:, -1].copy(), float(run.t[-1])
        evaluations += int(run.nfev)
        steps += run.t.size - 1
        if evaluations > budget:
            raise BudgetError(
                f"more than {budget} evaluations: {number + 1} of {chain.rods} legs took them"
            )
        arrival = float(state[1])
        gained += arrival * gain
        state[1] += arrival * gain
    return Answer(float(state[2]), arrival, time, evaluations, steps)


def _falling(
    gravity: float, gained: float, _time: float, state: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Free fall: z' = −v, v' = g, Δz' = speed gained so far."""
    return -float(state[1]), gravity, gained


class _Landing:
    """The event that a rod strikes."""

    terminal = True
    direction = -1.0

    def __init__(self, height: float) -> None:
        self.height = height

    def __call__(self, _time: float, state: NDArray[np.float64]) -> float:
        return float(state[0]) + self.height


def step_by_step(
    chain: Chain,
    gains: Sequence[float],
    drop: float,
    gravity: float,
    step: float,
    advance: Advance,
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

    def slope(now: Stage) -> Stage:
        return now[1], gravity, now[3], 0.0

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
    one = slope(state)
    two = slope(tuple([y + 0.5 * step * k for y, k in zip(state, one, strict=True)]))
    three = slope(tuple([y + 0.5 * step * k for y, k in zip(state, two, strict=True)]))
    four = slope(tuple([y + step * k for y, k in zip(state, three, strict=True)]))
    return tuple(
        [
            y + step / 6.0 * (a + 2.0 * (b + c) + d)
            for y, a, b, c, d in zip(state, one, two, three, four, strict=True)
        ]
    )
