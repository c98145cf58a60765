"""The impact coefficients against direct solutions of the paper's equations of motion."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.impact import alpha_inclined, alpha_level, alpha_liftoff, gamma_finite, impact_on
from rig.model.surface import Pile, Surface
from rig.units import Quantity
from tests.examples import examples
from tests.model.chains import close, decades, even_chain
from tests.model.reference import printed_alpha

RESTITUTIONS = st.floats(-0.9, 1.0)
FRICTIONS = st.one_of(st.just(0.0), st.floats(1e-6, 1.0))
INERTIAS = st.floats(0.02, 0.98)


def inclined_impulse(beta, mu, theta_deg, xi_y, xi_z):
    """∫F dt/(mV) from Eqs. S7 to S12 with f = μN, for m = V = 1 and L = 2 (so I = ξ).

    Unknowns: impulses N and F; changes of V_z, ω, V_y, ψ. The left end, which is struck, is at
    V_z − ω and V_y + ψ, ψ being counted so that the torque of S10 speeds that end up.
    """
    cos, sin = (f(mp.radians(mp.mpf(theta_deg))) for f in (mp.cos, mp.sin))
    beta, mu, xi_y, xi_z = map(mp.mpf, (beta, mu, xi_y, xi_z))
    up, along = cos + mu * sin, sin - mu * cos  # of the contact force, per unit of N
    rows = [
        # N, F, ΔV_z, Δω, ΔV_y, Δψ | right-hand side
        [-up, -1, 1, 0, 0, 0, 0],  # S7
        [up, -1, 0, xi_y, 0, 0, 0],  # S8
        [-along, 0, 0, 0, 1, 0, 0],  # S9
        [-along, 0, 0, 0, 0, xi_z, 0],  # S10
        [0, 0, cos, -cos, sin, sin, (1 + beta) * cos],  # S11
        [0, 0, 1, 1, 0, 0, 0],  # S12
    ]
    system = mp.matrix([row[:-1] for row in rows])
    return mp.lu_solve(system, mp.matrix([row[-1] for row in rows]))[1]


def level_impulse(beta, xi, xi_above, mass_above):
    """∫F dt/(mV) from Eqs. 3, 4, S1 and S2 with S3 to S6, for m = V = 1 and L = 2 (so I = ξ).

    Unknowns: F, N, U_R, U_L. Exact, by Cramer's rule in rational numbers.
    """
    beta, xi, xi_above, m_above = map(Fraction, (beta, xi, xi_above, mass_above))
    half = Fraction(1, 2)
    rows = [
        # F, N, U_R, U_L | right-hand side
        [1, 1, half, 0, 1 + beta * half],  # 3: ΔV_z = (β − U_R)/2 + 1
        [1, -1, xi * half, 0, -xi * beta * half],  # 4: Δω = −(U_R + β)/2
        [1, 0, -m_above * half, -m_above * half, -m_above],  # S1: ΔV_z' = 1 − (U_R + U_L)/2
        [1, 0, -xi_above * m_above * half, xi_above * m_above * half, 0],  # S2
    ]
    columns = list(zip(*rows, strict=True))
    system = [list(row) for row in zip(*columns[:4], strict=True)]
    first = [[row[-1], *row[1:4]] for row in rows]
    return determinant(first) / determinant(system)


def determinant(rows):
    if len(rows) == 1:
        return rows[0][0]
    return sum(
        (-1) ** i * row[0] * determinant([other[1:] for j, other in enumerate(rows) if j != i])
        for i, row in enumerate(rows)
        if row[0]
    )


def test_level_alpha_is_the_papers():
    assert alpha_level(0.5) == pytest.approx(0.25, rel=1e-15)
    assert alpha_level(0.0) == pytest.approx(1 / 6, rel=1e-15)
    assert alpha_level(-1.0, 0.4) == 0.0  # no collision
    assert alpha_level(0.5, 1.0) == 0.0  # the centre of percussion is where the rod strikes
    assert gamma_finite(1 / 3) == pytest.approx(4 / 3, rel=1e-15)
    assert gamma_finite(1 / 3, 1.0) == pytest.approx(2 / 3, rel=1e-15)


@examples(80)
@given(RESTITUTIONS, INERTIAS, INERTIAS, decades(-6, 6))
def test_equations_8_to_10_solve_the_equations_of_motion(beta, xi, xi_above, mass_above):
    wanted = float(level_impulse(beta, xi, xi_above, mass_above))
    found = alpha_level(beta, xi) / (1.0 + gamma_finite(xi, xi_above) / mass_above)
    assert close(found, wanted, 1e-14)


@examples(60)
@given(RESTITUTIONS, FRICTIONS, st.floats(0.01, 89.0), INERTIAS)
def test_equations_12_and_13_solve_the_equations_of_motion(beta, mu, theta, xi):
    with mp.workdps(50):
        wanted = inclined_impulse(beta, mu, theta, xi, xi)
        assert abs(printed_alpha(beta, mu, theta, xi) / wanted - 1) < mp.mpf(10) ** -40
    assume(math.tan(math.radians(theta)) > mu)  # where the rod slides nothing cancels in g(θ)
    assert close(alpha_inclined(beta, mu, theta, xi), float(wanted), 1e-13)


@examples(80)
@given(RESTITUTIONS, FRICTIONS, INERTIAS)
def test_no_incline_is_level(beta, mu, xi):
    level = alpha_level(beta, xi)
    assert alpha_inclined(beta, mu, 0.0, xi) == level
    # Eq. 13 near 0°: g(θ) = 1 − γ μ θ + O(θ²).
    theta = 1e-6
    slope = gamma_finite(xi) * mu * theta
    found = alpha_inclined(beta, mu, math.degrees(theta), xi) / level - 1.0
    assert found == pytest.approx(slope, rel=1e-4, abs=100 * theta**2)


@examples(80)
@given(RESTITUTIONS, st.floats(0.0, 90.0))
def test_without_friction_a_uniform_rod_has_the_papers_g(beta, theta):
    sin, cos = (f(math.radians(theta)) for f in (math.sin, math.cos))
    wanted = (1.0 + beta) / 6.0 * cos**2 / (1.0 + sin**2 / 3.0)
    assert alpha_inclined(beta, 0.0, theta) == pytest.approx(wanted, rel=1e-14, abs=1e-17)


@examples(80)
@given(RESTITUTIONS, FRICTIONS, st.floats(0.01, 1.0), st.floats(1.0, 89.0), INERTIAS)
def test_friction_raises_alpha(beta, mu, more, theta, xi):
    assume(math.tan(math.radians(theta)) > mu + more)
    assert alpha_inclined(beta, mu + more, theta, xi) > alpha_inclined(beta, mu, theta, xi)


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


@examples(80)
@given(st.floats(-1.0, 1.0), st.floats(0.02, 1.0), decades(-4, 4))
def test_the_energy_lost_is_the_work_of_the_surface(beta, xi, mass_above):
    """Level impact of one rod (m = V = 1) under a chain, with all rotations (Eqs. S1 to S6).

    The string joins ends of like speed, so F does no net work; N works on an end that goes from
    −1 to β. What is lost is therefore N (1 − β)/2, and N ≥ F ≥ 0, so no impact gains energy. Only
    the right J closes this balance.
    """
    m_above, alpha, gamma = map(Fraction, (mass_above, alpha_level(beta, xi), gamma_finite(xi)))
    beta, xi = Fraction(beta), Fraction(xi)
    pull = alpha / (1 + gamma / m_above)
    right = 1 + pull / m_above * (1 + 1 / xi)
    left_above = 1 + pull / m_above * (1 - 1 / xi)
    push = (beta - right) / 2 + 1 - pull  # Eq. 3
    lower = ((beta - right) / 2) ** 2 + xi * ((beta + right) / 2) ** 2
    upper = ((right + left_above) / 2) ** 2 + xi * ((right - left_above) / 2) ** 2
    lost = (1 - lower) / 2 + m_above * (1 - upper) / 2
    assert abs(lost - push * (1 - beta) / 2) < 1e-13
    assert push >= pull - Fraction(1, 10**15)
    assert lost >= -1e-15


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


def test_given_coefficients_win_over_the_surface():
    beads = Chain(RODS.masses, RODS.heights, alpha=Quantity(0.12, 0.02))
    assert impact_on(PILED, beads, 10.0).gamma == 0.0
    stiff = Chain(RODS.masses, RODS.heights, alpha=Quantity(0.12), gamma=0.7)
    impact = impact_on(SURFACE, stiff, 40.0, restitution=0.9, friction=0.9)
    assert (impact.alpha, impact.gamma, impact.basis) == (0.12, 0.7, "given")
    free = impact_on(SURFACE, Chain(RODS.masses, RODS.heights, gamma=0.7), 40.0)
    assert (free.alpha, free.gamma) == (alpha_inclined(0.5, 0.2, 40.0), 0.7)


def test_central_values_can_be_replaced():
    changed = impact_on(PILED, RODS, 40.0, restitution=0.1, friction=0.3)
    assert changed.alpha == alpha_inclined(0.1, 0.3, 40.0)
    assert impact_on(PILED, RODS, 10.0, restitution=0.1, friction=0.3).alpha == alpha_level(0.1)


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


def test_a_given_alpha_is_held_to_the_domain_too():
    def noted(alpha):
        chain = Chain(RODS.masses, RODS.heights, alpha=Quantity(alpha))
        return impact_on(SURFACE, chain, 40.0).notes

    assert noted(0.5) == noted(0.0) == ()
    assert "above ½" in noted(0.51)[0]
    assert "negative" in noted(-0.01)[0]


def test_below_the_sliding_angle_alpha_exceeds_its_level_value():
    """Outside the domain (θ < arctan μ = 11.3° here) friction would help more than the tilt costs.

    At the sliding angle itself g(θ) = cos²θ, so α is the level one again.
    """
    sliding = math.degrees(math.atan(0.2))
    assert alpha_inclined(0.5, 0.2, sliding) == pytest.approx(alpha_level(0.5), rel=1e-14)
    assert alpha_inclined(0.5, 0.2, sliding / 2) > alpha_level(0.5)
    assert alpha_inclined(0.5, 0.2, sliding * 1.01) < alpha_level(0.5)


@given(st.floats(-1.0, 1.0), st.floats(0.0, 1.0))
def test_equation_s20_solves_the_equations_of_motion(restitution, inertia):
    """For m = V = 1 and L = 2 (so I = ξ): the right end goes to 1 + β', the left end stays.

    N + F = ΔV_z (Eq. 3) and F − N = ξ Δω (Eq. 4), both changes being (1 + β')/2.
    """
    change = (1 + Fraction(restitution)) / 2
    push = (change - Fraction(inertia) * change) / 2
    assert abs(Fraction(alpha_liftoff(restitution, inertia)) - push) < Fraction(1, 10**15)


def test_the_papers_value_of_lift_off():
    assert alpha_liftoff() == pytest.approx(1 / 6, rel=1e-15)
    assert f"{alpha_liftoff():.2f}" == "0.17"


def test_a_surface_of_which_no_friction_is_said_has_none():
    assert Surface(Quantity(0.2)) == Surface(Quantity(0.2), Quantity(0.0))
