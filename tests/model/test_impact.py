"""The impact coefficients against direct solutions of the paper's equations of motion."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.impact import (
    ALPHA,
    PILE,
    alpha_inclined,
    alpha_level,
    gamma_finite,
    impact_on,
    stated_coefficients,
    with_coefficients,
)
from rig.model.surface import Pile, Surface
from rig.units import Quantity
from tests.examples import examples
from tests.model.chains import close, even_chain

RESTITUTIONS = st.floats(-0.9, 1.0)
FRICTIONS = st.one_of(st.just(0.0), st.floats(1e-6, 1.0))
INERTIAS = st.floats(0.02, 0.98)


def test_level_alpha_is_the_papers():
    assert alpha_level(0.5) == pytest.approx(0.25, rel=1e-15)
    assert alpha_level(0.0) == pytest.approx(1 / 6, rel=1e-15)
    assert alpha_level(-1.0, 0.4) == 0.0  # no collision
    assert alpha_level(0.5, 1.0) == 0.0  # the centre of percussion is where the rod strikes
    assert gamma_finite(1 / 3) == pytest.approx(4 / 3, rel=1e-15)
    assert gamma_finite(1 / 3, 1.0) == pytest.approx(2 / 3, rel=1e-15)


@examples(80)
@given(st.floats(0.002, 0.3), st.floats(0.1, 5.0), st.floats(0.02, 89.0))
def test_singular_exactly_between_the_roots_of_g(xi, mu, theta):
    """With t = tan θ, g(θ) ≤ 0 means γ t² − (γ − 1) μ t + 1 ≤ 0."""
    gamma, t = (1 + xi) ** 2 / (4 * xi), math.tan(math.radians(theta))
    terms = gamma * t * t, -(gamma - 1) * mu * t, 1.0
    assume(abs(sum(terms)) > 1e-9 * max(map(abs, terms)))  # rounding decides on the root itself
    if sum(terms) < 0.0:
        assert t < mu  # never where the rod slides
        with pytest.raises(DomainError, match="singular") as caught:
            alpha_inclined(0.5, mu, theta, xi)
        assert "tan θ > μ" in caught.value.hint
    else:
        assert alpha_inclined(0.5, mu, theta, xi) > 0.0


SURFACE = Surface(Quantity(0.5, 0.05), Quantity(0.2, 0.02))
PILED = Surface(SURFACE.restitution, SURFACE.friction, Pile(30.0, Quantity(-0.37)))
RODS = even_chain(5)


@pytest.mark.parametrize(
    ("surface", "incline", "basis", "alpha"),
    [
        (SURFACE, 0.0, "level", alpha_level(0.5)),
        (SURFACE, 40.0, "surface", alpha_inclined(0.5, 0.2, 40.0)),
        (PILED, 0.0, "pile", alpha_level(-0.37)),
        (PILED, 29.9, "pile", alpha_level(-0.37)),
        (PILED, 30.0, "surface", alpha_inclined(0.5, 0.2, 30.0)),
    ],
)
def test_what_alpha_rests_on(surface, incline, basis, alpha):
    impact = impact_on(surface, RODS, incline)
    assert (impact.basis, impact.alpha, impact.gamma) == (basis, alpha, gamma_finite(1 / 3))
    assert impact.notes == ()


OTHER = {"restitution": 0.1, "friction": 0.3, PILE: 0.2}


def test_given_coefficients_win_over_the_surface():
    beads = Chain(RODS.masses, RODS.heights, alpha=Quantity(0.12, 0.02))
    assert impact_on(PILED, beads, 10.0).gamma == 0.0
    stiff = Chain(RODS.masses, RODS.heights, alpha=Quantity(0.12), gamma=0.7)
    impact = impact_on(*with_coefficients(SURFACE, stiff, OTHER), 40.0)
    assert (impact.alpha, impact.gamma, impact.basis) == (0.12, 0.7, "given")
    free = impact_on(SURFACE, Chain(RODS.masses, RODS.heights, gamma=0.7), 40.0)
    assert (free.alpha, free.gamma) == (alpha_inclined(0.5, 0.2, 40.0), 0.7)


def test_central_values_can_be_replaced():
    changed = with_coefficients(PILED, RODS, OTHER)
    assert impact_on(*changed, 40.0).alpha == alpha_inclined(0.1, 0.3, 40.0)
    assert impact_on(*changed, 10.0).alpha == alpha_level(0.2)
    assert {k: q.value for k, q in stated_coefficients(*changed, 10.0).items()} == {PILE: 0.2}
    given = with_coefficients(*changed, {ALPHA: 0.3})
    assert stated_coefficients(*given, 10.0) == {ALPHA: Quantity(0.3)}


@examples(80)
@given(st.floats(-2.0, 3.0), FRICTIONS, st.one_of(st.just(0.0), st.floats(1e-6, 89.0)))
def test_notes_say_when_and_only_when_the_domain_is_left(beta, mu, incline):
    impact = impact_on(Surface(Quantity(beta), Quantity(mu)), RODS, incline)
    slope = math.tan(math.radians(incline))
    assume(incline == 0.0 or not close(slope, mu, 1e-12))
    sticks = incline > 0.0 and slope < mu
    notes = " ".join(impact.notes)
    assert ("does not slide" in notes) == sticks
    assert ("above ½" in notes) == (impact.alpha > 0.5)
    assert ("negative" in notes) == (impact.alpha < 0.0)
    assert len(impact.notes) == sticks + (impact.alpha > 0.5) + (impact.alpha < 0.0)


def test_a_surface_of_which_no_friction_is_said_has_none():
    assert Surface(Quantity(0.2)) == Surface(Quantity(0.2), Quantity(0.0))
