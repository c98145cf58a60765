"""Resolved falls by their own physics: nothing here comes from the model but what it predicts."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.studies.published_falls import folded_time
from rig.model.impact import alpha_inclined, alpha_level, gamma_finite
from sim.resolved.fall import fall
from sim.resolved.foresight import impossible
from sim.resolved.hanging import stable_step
from sim.resolved.scene import Board, Bounce, Chain, Fall, Rods, Strings

pytestmark = pytest.mark.usefixtures("loops_compiled")

GRAVITY, DROP = 9.81, 1.0
MASS, LENGTH, DIAMETER = 5.8e-3, 0.102, 12.7e-3
PITCH = 1.165 / 24
TILT = math.radians(12)


def rods(count: int, *, tilt: float = TILT, spread: float = 0.0, seed: int = 0, **changes) -> Rods:
    rng = np.random.default_rng(seed)
    signs = (-1.0) ** np.arange(count)
    return replace(
        Rods(
            masses=np.full(count, MASS),
            heights=PITCH * np.arange(count),
            diameters=np.full(count, DIAMETER),
            tilts=signs * (tilt + math.radians(spread) * rng.normal(size=count)),
            yaws=math.radians(spread) * rng.normal(size=count),
            aside=1e-3 * spread * rng.normal(size=count),
            length=LENGTH,
        ),
        **changes,
    )


def board(incline: float, restitution: float = 0.5, friction: float = 0.2, time_s: float = 2e-4):
    return Board(math.radians(incline), Bounce(restitution, time_s, friction))


WOOD = Bounce(0.5, 2e-4, 0.3)


def struck(incline: float, seed: int = 1) -> Chain:
    return Chain(rods(3, spread=1.0, seed=seed), Strings(), DROP, GRAVITY, board(incline), WOOD)


SCENES = [struck(0.0), struck(40.0, seed=9), struck(60.0, seed=8)]


@pytest.fixture(scope="module")
def falls() -> dict[float, list[Fall]]:
    """The same three falls with two steps."""
    return {step: [fall(one, step=step, after=1e-3) for one in SCENES] for step in (1e-5, 5e-6)}


@pytest.mark.parametrize("spin", [0.0, 1e-9])  # by formula, and by steps
def test_free_fall_is_exact(spin):
    chain = Chain(rods(3), Strings(), 0.18, GRAVITY, swing=np.full(3, 0.02), spin=spin)
    found = fall(chain, until=0.03)
    exact = 0.18 + PITCH * np.arange(3) - 0.5 * GRAVITY * found.times[:, None] ** 2
    assert np.abs(found.heights - exact).max() < 1e-9
    assert found.lost["strings"] < 1e-30  # rounding moves rods by 1e-17 m against each other


def test_air_slows_a_rod_as_the_closed_form_says():
    kappa = np.full(2, 2.0)
    slow = Chain(rods(2), Strings(), 1.0, GRAVITY, drag=kappa)
    stepped = replace(slow, spin=1e-9)  # so no formula is used
    by_formula, by_steps = fall(slow, until=0.05), fall(stepped, until=0.05)
    count = min(by_formula.times.size, by_steps.times.size)
    assert np.abs(by_formula.heights[:count] - by_steps.heights[:count]).max() < 1e-8
    t = by_formula.times[-1]
    fallen = math.log(math.cosh(t * math.sqrt(GRAVITY * 2.0))) / 2.0
    assert by_formula.heights[-1, 0] == pytest.approx(1.0 - fallen, abs=1e-8)


def test_energy_never_grows_and_what_goes_is_accounted_for(falls):
    for step, some in falls.items():
        for found in some:
            assert np.diff(found.energy).max() < 1e-12 * found.energy[0]
            assert min(found.lost.values()) > -1e-15  # without air there is rounding alone
        spent = [found.energy[0] - found.energy[-1] for found in some]
        gaps = [sum(one.lost.values()) / e - 1 for one, e in zip(some, spent, strict=True)]
        assert max(map(abs, gaps)) < 0.02 * (step / 1e-5) ** 2
    for found in falls[5e-6]:
        assert found.lost["board"] > 0.0
        assert found.lost["strings"] > 0.0


def test_momentum_is_what_gravity_and_board_give(falls):
    for found in falls[1e-5]:
        fallen = -3 * MASS * GRAVITY * found.frames_s
        assert np.abs(found.momentum[:, 2] - fallen).max() < 1e-12
        assert np.abs(found.momentum[:, :2]).max() < 1e-12
        assert found.board_impulse[2] > 0.0


LIMIT = [
    (0.0, beta, 0.2, above) for beta in (0.2, 0.5, 0.8) for above in (1.0, 3.0, 1e3)
] + [
    (theta, beta, mu, 1e3)
    for theta in (30.0, 40.0, 60.0, 80.0)
    for beta in (0.2, 0.5, 0.8)
    for mu in (0.0, 0.1, 0.2)
]  # fmt: skip


def test_one_rods_impact_in_the_papers_limit():
    """Eqs. 8, 9 and 12: thin rods of little tilt, no rolling, a string stiff beside the touch."""
    drop = 0.2

    def chain(incline: float, restitution: float, friction: float, above: float) -> Chain:
        two = rods(
            2, tilt=math.radians(1.0), masses=MASS * np.array([1.0, above]),
            diameters=np.full(2, 1e-4), rolling=False,
        )  # fmt: skip
        surface = board(incline, restitution, friction, 2e-4)
        return Chain(two, Strings(0.1, 0.0005), drop, GRAVITY, surface)

    ends = math.sqrt(2 * drop / GRAVITY) + 1e-3
    found = [fall(chain(*case), until=ends, step=7.5e-7) for case in LIMIT]
    speed = math.sqrt(2 * GRAVITY * drop)
    for (theta, beta, mu, above), one in zip(LIMIT, found, strict=True):
        alpha = alpha_inclined(beta, mu, theta) if theta else alpha_level(beta)
        wanted = alpha / (1.0 + gamma_finite(1 / 3) / above)
        assert one.pulled[0] / (MASS * speed) == pytest.approx(wanted, rel=0.03), (theta, beta, mu)


def test_the_step_converges_before_rods_strike_rods():
    """Errors of the top rod's height after the first impact fall with the square of the step."""
    chain = replace(SCENES[1], touching=None)
    ends = math.sqrt(2 * DROP / GRAVITY) + 3e-3

    def height(step: float) -> float:
        found = fall(chain, until=ends, step=step)
        gained = found.heights[:, -1] + 0.5 * GRAVITY * found.times**2
        return float(np.interp(ends - 1e-4, found.times, gained))

    exact = height(1.25e-6)
    errors = [abs(height(step) - exact) for step in (1e-5, 5e-6)]
    assert errors[0] < 0.1e-3 / 4  # of Δz, shared by the impacts before chaos
    assert math.log2(errors[0] / errors[1]) > 1.5


def test_a_folded_chain_falls_as_calkin_and_march_found():
    """Their T/T_ff = 0.8472 is of a smooth chain; many rods come near, as one over their number."""
    assert 2 * folded_time(80) - folded_time(40) == pytest.approx(0.8472, rel=0.01)


@pytest.mark.parametrize("touching", [None, Bounce(0.5, 1e-5, 0.3)])
def test_a_shorter_touch_needs_a_shorter_step_and_gives_no_energy(touching):
    chain = replace(SCENES[0], start=0.05, board=board(0.0, time_s=1e-5), touching=touching)
    step = stable_step(chain)
    assert step <= 1e-5 / 5
    kept, lost = (fall(chain, step=s).energy for s in (step, 1e-5))
    assert np.diff(kept).max() < 1e-6 * kept[0]
    assert np.diff(lost).max() > 1e-2 * kept[0]  # what the step is for


def test_a_chain_that_cannot_hang_is_refused_beforehand():
    crossed = replace(SCENES[0], rods=rods(3, tilt=math.radians(30)))
    assert impossible(SCENES[0]) is None
    assert "rods 1 and 2" in str(impossible(crossed))
    assert impossible(replace(crossed, touching=None)) is None  # they pass through each other
    assert "rod 1 is in the board" in str(impossible(replace(SCENES[0], start=-0.01)))
    thick_air = replace(SCENES[0], drag=np.full(3, 1e3))
    assert "more than 5 s" in str(impossible(thick_air))
