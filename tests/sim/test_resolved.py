"""Resolved falls by their own physics: nothing here comes from the model but what it predicts."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.errors import InputError
from rig.link.messages import pack_label
from rig.model.impact import alpha_inclined, alpha_level, gamma_finite
from rig.protocol import reader
from sim import resolved_lab
from sim.dials import ResolvedDials
from sim.resolved import foresight
from sim.resolved.contact_law import damping
from sim.resolved.fall import AFTER, fall
from sim.resolved.foresight import duration, impossible
from sim.resolved.hanging import stable_step
from sim.resolved.motion import push
from sim.resolved.scene import Board, Bounce, Chain, Fall, Rods, Strings
from sim.resolved_lab import ResolvedLab, at_level
from sim.scene import set_scene
from tests.refusals import refused
from tests.tables import protocol_text

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


@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize(("mass", "speed"), [(1e-3, 3.0), (0.1, 0.5)])
def test_a_bounce_by_itself_has_the_restitution_asked_for(restitution, mass, speed):
    stiffness, d = 4e5, damping(restitution)
    step = 1e-3 * math.pi * math.sqrt(mass / stiffness)
    overlap, rate, fastest = 1e-12, speed, 0.0
    while overlap > 0.0:
        force, fastest = push(overlap, rate, fastest, stiffness, d)
        rate = rate - step * force / mass
        overlap = overlap + step * rate
    assert -rate / speed == pytest.approx(restitution, abs=6e-3)  # Euler's error at this step


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


def test_rods_that_brush_each_other_on_the_way_down_have_not_landed():
    """They begin 1 mm apart, and one is driven into the other far above the board."""
    low, high = 0.0, DIAMETER + 1e-3
    two = rods(2, tilt=0.0, heights=np.array([low, high]), aside=np.array([0.0, 2e-3]))
    chain = Chain(two, Strings(), DROP, GRAVITY, board(0.0), WOOD, swing=np.array([0.0, -1.0]),
                  drag=np.array([2.0, 0.0]))  # fmt: skip
    found = fall(chain, after=0.0)
    assert found.lost["rods"] > 0.0
    apart = np.linalg.norm(found.places[:, :, 1] - found.places[:, :, 0], axis=1)
    assert apart[found.frames_s < 0.4].min() < DIAMETER  # they met in the air
    assert found.touched_s.min() > math.sqrt(2 * DROP / GRAVITY)
    assert np.nanmin(found.touched_height) < 5e-3


@pytest.mark.parametrize("touching", [None, Bounce(0.5, 1e-5, 0.3)])
def test_a_shorter_touch_needs_a_shorter_step_and_gives_no_energy(touching):
    chain = replace(SCENES[0], start=0.05, board=board(0.0, time_s=1e-5), touching=touching)
    step = stable_step(chain)
    assert step <= 1e-5 / 5
    kept, lost = (fall(chain, step=s).energy for s in (step, 1e-5))
    assert np.diff(kept).max() < 1e-6 * kept[0]
    assert np.diff(lost).max() > 1e-2 * kept[0]  # what the step is for


@pytest.mark.parametrize("kappa", [0.0, 0.5, 3.0])
def test_how_long_a_fall_takes_is_known_before(kappa):
    """What strikes nothing and sinks through the board's place, with its air."""
    chain = Chain(rods(2), Strings(), 0.3, GRAVITY, drag=np.full(2, kappa))
    found = fall(chain)
    there = float(np.interp(0.0, -found.heights[:, -1], found.times))
    assert duration(chain) == pytest.approx(there + AFTER, abs=1e-6)


def test_a_chain_that_cannot_hang_is_refused_beforehand():
    crossed = replace(SCENES[0], rods=rods(3, tilt=math.radians(30)))
    assert impossible(SCENES[0]) is None
    assert "rods 1 and 2" in str(impossible(crossed))
    assert impossible(replace(crossed, touching=None)) is None  # they pass through each other
    assert "rod 1 is in the board" in str(impossible(replace(SCENES[0], start=-0.01)))
    assert "more than 5 s" in str(impossible(replace(SCENES[0], drag=np.full(3, 1e3))))


SCENE = protocol_text("four-rods")


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("scene") / "four.yaml"
    path.write_text(SCENE)
    return str(path)


@pytest.fixture(scope="module")
def dropped(scene) -> tuple[ResolvedLab, list, list]:
    """Both drops of a session on a perfect rig: lab, truths, edges."""
    truths: list = []
    dials = replace(ResolvedDials.quiet(), skew_sd=2e-3, yaw_sd=1.0)
    lab = ResolvedLab(reader.read(scene), dials, 3, truths.append)
    edges = [lab.drop(pack_label(run, 1)) for run in (1, 2)]
    return lab, truths, edges


def test_a_short_free_chain_falls_on_beside_a_long_one(tmp_path):
    """It passes the contact level by more than a rod's length before the long one's end."""
    chain = "{rods: 2, length: 20 mm, diameter: 12.7 mm, rod_length: 102 mm}"
    (tmp_path / "short.yaml").write_text(SCENE.replace("{like: A}", chain))
    truths: list = []
    lab = ResolvedLab(reader.read(tmp_path / "short.yaml"), ResolvedDials.quiet(), 3, truths.append)
    lab.drop(pack_label(1, 1))
    fallen = 0.5 * GRAVITY * truths[0].fall_time_s ** 2
    assert truths[0].separation_m == pytest.approx(0.62 - fallen, abs=1e-6)


def test_truth_at_level_and_at_strike(dropped):
    _, truths, _ = dropped
    for truth in truths:
        top = 0.6 + 0.145

        def free(time_s, top=top):
            return top - 0.5 * GRAVITY * time_s**2

        assert truth.separation_m == pytest.approx(free(truth.fall_time_s), abs=1e-7)
        raw = free(truth.fall_time_s - truth.release_skew_s)
        assert truth.separation_raw_m == pytest.approx(raw, abs=1e-7)
        strike = free(truth.strike_time_s) - truth.contact_height_m
        assert truth.separation_strike_m == pytest.approx(strike, abs=1e-7)
        assert truth.speed_m_s > math.sqrt(2 * GRAVITY * 0.74) > 0
        assert truth.separation_m > 1e-3  # struck rods pulled it down
        # Noise of reading is 0.5 mm; the last frame comes up to 1/480 s early.
        assert truth.camera_separation_m == pytest.approx(truth.separation_m, abs=15e-3)
        assert truth.camera_speed_m_s == pytest.approx(truth.speed_m_s, abs=0.5)


def test_a_drop_comes_out_the_same_again_alone_and_made_ahead(dropped):
    lab, truths, edges = dropped
    assert lab.drop(pack_label(2, 1)) == edges[1]
    truths.pop()
    twin = ResolvedLab(lab.protocol, lab.dials, 3)
    labels = [pack_label(run, 1) for run in (2, 1)]
    twin.make_ahead(labels)
    twin.let_fall = None  # whatever falls now
    assert [twin.drop(label) for label in labels] == edges[::-1]


def test_a_fall_that_would_take_minutes_is_refused_and_a_long_one_told_of(
    scene, tmp_path, monkeypatch, caplog
):
    def asked(path: str) -> None:
        set_scene("sim", {"protocol": path, "dynamics": "resolved"})

    asked(scene)
    assert not caplog.records
    monkeypatch.setattr(foresight, "is_compiled", lambda: False)
    monkeypatch.setattr(resolved_lab, "is_compiled", lambda: False)
    asked(scene)
    (told,) = caplog.messages
    assert "numba is not installed" in told
    small = Path(scene).read_text()
    for was, now in (("145 mm", "20 mm"), ("12.7 mm", "0.1 mm"), ("102 mm", "2 mm")):
        small = small.replace(was, now)
    path = tmp_path / "threads.yaml"
    path.write_text(small)
    assert "numba" in refused(InputError, "of 4 rods would take", asked, str(path)).hint


def test_a_top_rod_that_never_lands_is_said(dropped):
    lab, _, _ = dropped
    struck = replace(fall(lab.chains(pack_label(1, 1))["impact"]), touched_s=np.full(4, np.inf))
    refused(InputError, "strikes nothing", at_level, struck, GRAVITY)
