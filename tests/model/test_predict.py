"""Predictions: uncertainties and domain, the paper's figures, the table of reference values."""

import math
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest

from rig.bench.references import exact_coefficients, exact_fall
from rig.model import paper
from rig.model.chain import Chain
from rig.model.fall import fall
from rig.model.impact import alpha_inclined, gamma_finite
from rig.model.predict import predict
from rig.model.surface import Pile, Surface
from rig.protocol.reader import read
from rig.units import Quantity
from tests.model.chains import even_chain
from tests.tables import cases, read_table

CHAIN = even_chain(25)
SURFACE = Surface(Quantity(0.5), Quantity(0.2))
DROP, GRAVITY = Quantity(0.18), Quantity(9.81)
GIVEN = 0.12  # α
CENTRE = {"beta": 0.5, "mu": 0.2, "drop": 0.18, "gravity": 9.81}


def with_u(incline=40.0, **u):
    """Prediction whose inputs have the named standard uncertainties, and no others."""
    chain = CHAIN
    if "alpha" in u:  # which is given then
        chain = replace(CHAIN, alpha=Quantity(GIVEN, u["alpha"]), gamma=gamma_finite(1 / 3))
    value = {name: Quantity(number, u.get(name, 0.0)) for name, number in CENTRE.items()}
    surface = Surface(value["beta"], value["mu"])
    return predict(chain, surface, incline, value["drop"], value["gravity"])


def slopes(name, incline):
    """∂Δz and ∂V by one input, by differences of 50-digit falls."""

    def end(x):
        v = {**CENTRE, "incline": incline, "inertia": CHAIN.inertia, name: x}
        by = exact_coefficients({**v, "restitution": v["beta"], "friction": v["mu"]}) | v
        given = ([by[coefficient]] * CHAIN.rods for coefficient in ("alpha", "gamma"))
        found = exact_fall(CHAIN.masses, CHAIN.heights, *given, v["drop"], v["gravity"])
        return found["separation"], found["speed"]

    step, x = Decimal("1e-12"), Decimal(CENTRE.get(name, GIVEN))
    return [float((b - a) / (2 * step)) for a, b in zip(end(x - step), end(x + step), strict=True)]


@pytest.mark.parametrize("incline", [15.0, 40.0, 80.0])
@pytest.mark.parametrize("name", ["beta", "mu", "drop", "alpha"])
def test_each_uncertainty_is_slope_times_input(name, incline):
    u = 1e-5  # so small that curvature is below 1e-6 of the slope
    found = with_u(incline, **{name: u})
    separation, speed = slopes(name, incline)
    assert found.separation_u_m == pytest.approx(abs(separation) * u, rel=1e-6, abs=0)
    assert found.speed_u_m_s == pytest.approx(abs(speed) * u, rel=1e-6, abs=0)


def test_a_small_uncertain_speed_and_little_air_count():
    given = {key: Quantity(number, 0.0) for key, number in CENTRE.items()}
    scene = CHAIN, Surface(given["beta"], given["mu"]), 40.0, given["drop"], given["gravity"]

    def pushed(value, u=0.0):
        return predict(*scene, initial_speed=Quantity(value, u))

    def held(share, u=0.0):
        return predict(*scene, kappas=[0.01 * share] * len(CHAIN.masses), drag_u=u)

    for found, value in ((pushed, 0.1), (held, 1.0)):
        u = 0.5 * value
        moved = abs(found(value + u).speed_m_s - found(value - u).speed_m_s) / 2
        assert moved > 0.0
        assert found(value, u).speed_u_m_s == pytest.approx(moved, rel=1e-9)


def test_gravity_that_may_be_nearly_nothing_is_halved_and_no_less():
    g, u = CENTRE["gravity"], 0.9 * CENTRE["gravity"]
    found = with_u(gravity=u)
    high, low = math.sqrt((g + u) / g), math.sqrt(0.5)
    wanted = found.speed_m_s * (high - low) * u / (u + g / 2)
    assert found.speed_u_m_s == pytest.approx(wanted, rel=1e-11)


@pytest.mark.parametrize("mu", [0.0, 1e-6])
def test_uncertainty_at_the_edge_of_what_friction_can_be_is_not_halved(mu):
    """μ cannot go below zero; a step to one side only still gives slope times input."""
    u = 1e-5
    found = predict(CHAIN, Surface(Quantity(0.5), Quantity(mu, u)), 40.0, DROP, GRAVITY)
    ends = [
        fall(CHAIN, alpha_inclined(0.5, x, 40.0), gamma_finite(1 / 3), 0.18, 9.81)
        for x in (0.0, 1e-4)
    ]
    change = ends[1].separation_m - ends[0].separation_m
    assert found.separation_u_m == pytest.approx(change / 1e-4 * u, rel=1e-3)


def test_a_pile_has_its_own_restitution_and_no_friction():
    surface = Surface(Quantity(0.5, 0.3), Quantity(0.2, 0.1), Pile(30.0, Quantity(-0.37, 1e-5)))
    found = predict(CHAIN, surface, 10.0, DROP, GRAVITY)
    level = predict(CHAIN, Surface(Quantity(-0.37, 1e-5)), 0.0, DROP, GRAVITY)
    assert (found.separation_m, found.speed_m_s) == (level.separation_m, level.speed_m_s)
    assert (found.separation_u_m, found.speed_u_m_s) == (level.separation_u_m, level.speed_u_m_s)
    assert found.separation_u_m > 0.0
    assert found.in_domain
    assert any("pile" in note for note in found.notes)
    assert (found.model, level.model) == ("discrete, pile", "discrete")


@cases
def test_outside_the_domain_a_prediction_says_so_and_is_still_given(alpha, note):
    found = predict(replace(CHAIN, alpha=Quantity(alpha)), SURFACE, 40.0, DROP, GRAVITY)
    assert (found.in_domain, len(found.notes)) == (note is None, int(note is not None))
    assert note is None or note in found.notes[0]
    assert math.copysign(1.0, found.separation_m) == math.copysign(1.0, alpha)


# ξ = 0.01 makes γ = 25.5; g(θ) ≤ 0 for tan θ between the roots of γ t² − (γ − 1) μ t + 1.
LIGHT_ENDED = Chain(CHAIN.masses, CHAIN.heights, inertia=0.01)
MIDDLE_DEG = math.degrees(math.atan((gamma_finite(0.01) - 1) / (2 * gamma_finite(0.01))))


def test_where_equation_13_is_singular_there_is_no_prediction():
    found = predict(LIGHT_ENDED, Surface(Quantity(0.5), Quantity(1.0)), MIDDLE_DEG, DROP, GRAVITY)
    assert not found.in_domain
    assert "singular" in found.notes[0]
    assert found.alpha is found.gamma is found.separation_m is found.speed_m_s is None
    assert found.fall_time_s is found.separation_u_m is found.speed_u_m_s is None
    assert found.free_fall_speed_m_s == pytest.approx(math.sqrt(2 * 9.81 * 1.345), rel=1e-15)


def test_friction_that_may_be_singular_still_allows_a_prediction():
    """g(θ) > 0 at μ = 0.4 but not at 0.4 + 0.05."""
    found = predict(LIGHT_ENDED, Surface(Quantity(0.5), Quantity(0.4, 0.05)), 15.0, DROP, GRAVITY)
    assert found.separation_m > 0.0


def test_figure_4_ends_at_the_surface_with_the_separation():
    columns = paper.figure_4()
    assert columns["height_m"][-1] == pytest.approx(0.0, abs=1e-15)
    assert columns["free_height_m"][-1] == pytest.approx(0.20034710240655192, rel=1e-12)
    # In free fall V² = 2g × fallen: an energy balance that nothing here computes.
    for height, speed2 in zip(columns["free_height_m"], columns["free_speed2"], strict=True):
        assert speed2 == pytest.approx(2 * paper.GRAVITY * (1.345 - height), rel=1e-12, abs=1e-14)


@cases
def test_the_figures_of_the_paper_are_these_numbers(figure, columns):
    found = getattr(paper, figure)()
    sums = {name: [len(of), of[0], of[-1], math.fsum(of)] for name, of in found.items()}
    assert sums.keys() == columns.keys()
    for name, wanted in columns.items():
        assert sums[name] == pytest.approx(wanted, rel=1e-12, abs=1e-14), name


def test_what_the_text_says_otherwise_than_the_equations():
    assert paper.claims() == read_table(__file__, "claims")


PROTOCOLS = Path(__file__).parents[2] / "protocols"


@cases
def test_read_from_the_protocol(name, pile, incline, alpha, separation, speed, time):
    protocol = read(PROTOCOLS / f"{name}.yaml")
    surface = protocol.surface if pile else replace(protocol.surface, pile=None)
    chain = next(iter(protocol.chains.values())).chain
    found = predict(chain, surface, incline, protocol.drop, protocol.gravity)
    assert (found.in_domain, found.incline_deg) == (True, incline)
    values = found.alpha, found.separation_m, found.speed_m_s, found.fall_time_s
    for value, wanted in zip(values, (alpha, separation, speed, time), strict=True):
        if wanted is not None:
            assert value == pytest.approx(float(wanted), rel=1e-12, abs=0)
    stone = math.sqrt(2 * protocol.gravity.value * (protocol.drop.value + chain.heights[-1]))
    assert found.free_fall_speed_m_s == pytest.approx(stone, rel=1e-15)
    assert found.speed_m_s > stone
