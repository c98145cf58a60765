"""The problems of `rig bench precision`, each with every method that applies, ours first."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from scipy import linalg, optimize

from rig.analysis.adjust import least_squares
from rig.analysis.equations import Linearization
from rig.analysis.square_root import EquationRows
from rig.arrays import Array
from rig.bench import references
from rig.bench.solvers import SOLVERS, Legs, folding, in_air, lasting_impacts, solve
from rig.bench.work import Answer, Method, WorkProblem, direct, end_values
from rig.errors import RigError
from rig.model import continuum, paper
from rig.model.chain import Chain
from rig.model.drag import drag_fall, drag_leg, fallen, falling_speed
from rig.model.fall import fall, kicks
from rig.model.impact import impact_on

KAPPA = 0.06
"""κ of the air, 1/m: a terminal speed of 13 m/s."""
CONTACTS_S = (1e-3, 1e-5, 1e-7)
"""τ of lasting impacts."""
CONTACT_RODS = 3
"""Rods of the chain whose impacts last; what solvers take grows in proportion."""
BANDS_M = (0.8, 0.02, 5e-4)
"""Over which the beams of a fit are spread: the narrower, the worse its condition."""
_BEAMS = 12
_IMPACT = impact_on(paper.BARE, paper.UNIFORM, paper.MIDDLE_INCLINE)
_PLACE = paper.DROP, paper.GRAVITY
_FREE_FALL = {"drop": paper.DROP, "gravity": paper.GRAVITY}
_TOLERANCES = tuple(10.0**-n for n in range(2, 14))


def problems(*, quick: bool = False) -> Iterator[WorkProblem]:
    """Yield every problem; of those that differ by one number a quick study has the first."""
    few = 1 if quick else None
    yield from (_air(), _fold())
    yield from map(contact, CONTACTS_S[:few])
    yield from map(beam_fit, BANDS_M[:few])
    yield fall_time()


def _by_solvers(legs: Legs, tolerances: tuple[float, ...] = _TOLERANCES) -> Iterator[Method]:
    for solver in SOLVERS:
        yield Method(solver, tolerances, "rtol {:.0e}", partial(solve, legs, solver))


def _air() -> WorkProblem:
    chain, rods = paper.UNIFORM, paper.RODS
    alphas, gammas, kappas = ([x] * rods for x in (_IMPACT.alpha, _IMPACT.gamma, KAPPA))
    gains = kicks(chain, alphas, _IMPACT.gamma)
    legs = in_air(chain.heights, gains, KAPPA, *_PLACE)
    return WorkProblem(
        "air", f"{rods} rods in air",
        _FREE_FALL,
        partial(
            references.exact_fall, chain.masses, chain.heights, alphas, gammas, kappas=kappas
        ),
        "legs in closed form as textbooks have them, heights subtracted",
        [
            direct("closed legs (rig)",
                   lambda: Answer(end_values(drag_fall(chain, gains, kappas, *_PLACE)), rods)),
            *_by_solvers(legs),
        ],
    )  # fmt: skip


def _fold() -> WorkProblem:
    reach = _IMPACT.gamma * paper.PITCH
    case = {"length": paper.LENGTH, "reach": reach, "alpha": _IMPACT.alpha} | _FREE_FALL
    chain = continuum.UniformChain(paper.LENGTH, reach, _IMPACT.alpha, 1.0, *_PLACE)

    def gauss(nodes: float) -> Answer:
        end = continuum.end(chain, nodes=int(nodes))
        return Answer(end_values(end), end.evaluations)

    ours = Method("Gauss–Legendre (rig)", (2, 3, 4, 6, 8, 12, 16, 24), "{:.0f} nodes", gauss)
    methods, route = [ours, *_by_solvers(folding(**case))], "S15 as a hypergeometric function"
    return WorkProblem("fold", "a continuous chain", case, references.continuum, route, methods)


def contact(contact_s: float) -> WorkProblem:
    """Let impacts last: the stiff form of a fall."""
    rods = CONTACT_RODS
    chain = Chain((1.0,) * rods, paper.UNIFORM.heights[:rods])
    gains = kicks(chain, [_IMPACT.alpha] * rods, _IMPACT.gamma)

    return WorkProblem(
        f"contact-{contact_s:.0e}", f"{rods} rods, impacts that last {contact_s:.0e} s",
        {"contact_s": contact_s},
        partial(references.lasting_impacts, chain.heights, gains, *_PLACE),
        "series of the exponential integral, leg by leg",
        [
            direct("impacts at once (rig)", lambda: Answer(
                end_values(fall(chain, _IMPACT.alpha, _IMPACT.gamma, *_PLACE)), rods)),
            *_by_solvers(
                lasting_impacts(chain.heights, gains, *_PLACE, contact_s), _TOLERANCES[1:11:2]
            ),
        ],
        "Radau", "RK45", _TOLERANCES[9],
    )  # fmt: skip


def beam_fit(band: float) -> WorkProblem:
    """Find where, how fast and under what gravity a fall began, from its times at beams.

    Beams are `band` apart in all, about 1 m below the release; t = 2s/(v₀ + √(v₀² + 2gs)).
    """
    rng = np.random.default_rng(1)
    beams = np.linspace(1.0 - band / 2, 1.0 + band / 2, _BEAMS)
    start = {"rise": 0.02, "speed": 0.3, "gravity": 9.81}
    times = _passages(beams, np.array([*start.values()]))[0]
    times += 1e-9 * band * rng.normal(size=_BEAMS)
    begin = np.array([0.0, 0.2, 9.0])

    def answer(p: Array, evaluations: int) -> Answer:
        return Answer(dict(zip(start, p.tolist(), strict=True)), evaluations)

    def by_qr(slopes: Array, residuals: Array) -> Any:
        q, r = linalg.qr(slopes, mode="economic")
        return linalg.solve_triangular(r, q.T @ residuals)

    def by_cholesky(slopes: Array, residuals: Array) -> Any:
        return linalg.cho_solve(linalg.cho_factor(slopes.T @ slopes), slopes.T @ residuals)

    def steps(solve_linear: Any, count: float) -> Answer:
        p = begin
        try:
            for _ in range(int(count)):
                passages, slopes = _passages(beams, p)
                p = p + solve_linear(slopes, times - passages)
        except linalg.LinAlgError as error:
            raise RigError(str(error)) from None
        return answer(p, int(count))

    def by_rig(done: float) -> Answer:
        sigma, evaluations = 2e-9 * band, 0

        def about(p: Array, _: float) -> Linearization:
            nonlocal evaluations
            evaluations += 1
            passages, slopes = _passages(beams, p)
            residuals = (passages - times) / sigma
            chi2 = float(residuals @ residuals)
            rows = EquationRows(slopes / sigma, residuals, np.arange(3))
            return Linearization({"": rows}, chi2, _BEAMS, chi2)

        return answer(least_squares(about, np.full(3, 1e6), begin, done=done).x, evaluations)

    minimize: Any = optimize.least_squares

    def by_scipy(tolerance: float) -> Answer:
        run = minimize(
            lambda p: _passages(beams, p)[0] - times,
            begin,
            lambda p: _passages(beams, p)[1],
            **dict.fromkeys(("xtol", "ftol", "gtol"), tolerance),
            x_scale="jac",
        )
        return answer(run.x, run.nfev)

    return WorkProblem(
        f"fit-{band * 1e3:g}mm", f"least squares, beams over {band * 1e3:g} mm",
        {f"n{n}": number for n, number in enumerate([*beams.tolist(), *times.tolist()])},
        references.beam_fit, "normal equations",
        [
            Method("square root (rig)", [10.0**n for n in range(9, -13, -3)], "step {:.0e} u",
                   by_rig),
            Method("QR", range(1, 9), "{:.0f} steps", partial(steps, by_qr)),
            Method("Cholesky", range(1, 9), "{:.0f} steps", partial(steps, by_cholesky)),
            Method("scipy least_squares", _TOLERANCES, "tolerance {:.0e}", by_scipy),
        ],
        "square root (rig)", "Cholesky",
    )  # fmt: skip


def _passages(beams: Array, p: Array) -> tuple[Array, Array]:
    """Times at which a fall passes beams, and their slopes in rise, speed and gravity."""
    way = p[0] + beams
    root = np.sqrt(p[1] ** 2 + 2.0 * p[2] * way)
    time = 2.0 * way / (p[1] + root)
    return time, np.column_stack([1.0 / root, -time / root, -0.5 * time * time / root])


def fall_time(kappa: float = KAPPA) -> WorkProblem:
    """Find when something has fallen 1.345 m in air."""
    distance, gravity = paper.LENGTH + paper.DROP, paper.GRAVITY
    air, latest = (gravity, kappa), 2.0 * math.sqrt(2.0 * distance / gravity)

    def by_scipy(finder: Any, accuracy: str, *where: object) -> Method:
        def find(tolerance: float) -> Answer:
            options = {"args": air, "full_output": True, accuracy: tolerance}
            run = finder(lambda t, *air: fallen(t, *air) - distance, *where, **options)[1]
            return Answer({"time": run.root}, run.function_calls)

        return Method(finder.__name__, _TOLERANCES, accuracy + " {:.0e}", find)

    return WorkProblem(
        "fall-time", "the time to fall 1.345 m in air",
        {"distance": distance, "gravity": gravity, "kappa": kappa},
        references.fall_time, "arcosh(e^κd)/√(κg)",
        [
            direct("closed form (rig)",
                   lambda: Answer({"time": drag_leg(distance, 0.0, gravity, kappa)[1]}, 1)),
            direct("as printed", lambda: Answer(
                {"time": math.acosh(math.exp(kappa * distance)) / math.sqrt(kappa * gravity)}, 1)),
            by_scipy(optimize.brentq, "xtol", 0.0, latest),
            by_scipy(optimize.newton, "tol", latest, falling_speed),
        ],
        "closed form (rig)", "as printed",
    )  # fmt: skip
