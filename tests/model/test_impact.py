"""Impact coefficients and a rod's pull, beside solutions of the paper's equations of motion.

The equations are solved in kilograms, metres and newton seconds for one drawn rod and chain, with
every impulse and every change of motion an unknown of its own.
"""

import math
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp

from rig.bench.references import exact_coefficients
from rig.errors import DomainError
from rig.model.fall import kicks
from rig.model.impact import alpha_inclined, alpha_level, gamma_finite, impact_on
from rig.model.surface import Pile, Surface
from rig.units import Quantity
from tests.examples import examples
from tests.model.chains import chains, close, even_chain
from tests.refusals import refused
from tests.tables import cases

FRICTIONS = st.one_of(st.just(0.0), st.floats(1e-6, 1.0))


@examples(80)
@given(st.floats(0.002, 0.3), st.floats(0.1, 5.0), st.floats(0.02, 89.0))
def test_singular_exactly_between_the_roots_of_g(xi, mu, theta):
    """With t = tan θ, g(θ) ≤ 0 means γ t² − (γ − 1) μ t + 1 ≤ 0."""
    gamma, t = (1 + xi) ** 2 / (4 * xi), math.tan(math.radians(theta))
    terms = gamma * t * t, -(gamma - 1) * mu * t, 1.0
    assume(abs(sum(terms)) > 1e-9 * max(map(abs, terms)))  # rounding decides on the root itself
    if sum(terms) < 0.0:
        assert t < mu  # never where the rod slides
        error = refused(DomainError, "singular", alpha_inclined, 0.5, mu, theta, xi)
        assert "tan θ > μ" in error.hint
    else:
        assert alpha_inclined(0.5, mu, theta, xi) > 0.0


SURFACE = Surface(Quantity(0.5, 0.05), Quantity(0.2, 0.02))
PILED = Surface(SURFACE.restitution, SURFACE.friction, Pile(30.0, Quantity(-0.37)))
RODS = even_chain(5)


@cases
def test_what_alpha_rests_on(piled, incline, basis, restitution):
    impact = impact_on(PILED if piled else SURFACE, RODS, incline)
    slopes = basis == "surface"
    alpha = alpha_inclined(restitution, 0.2, incline) if slopes else alpha_level(restitution)
    assert (impact.basis, impact.alpha, impact.gamma) == (basis, alpha, gamma_finite(1 / 3))
    assert impact.notes == ()


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


TIGHT = 1e-13
RESTITUTIONS = st.floats(-0.9, 1.0)
INERTIAS = st.floats(0.02, 1.0)
INCLINES = st.one_of(st.just(0.0), st.floats(12.0, 85.0))
SLIDING_FRICTIONS = st.floats(0.0, 0.2)
LENGTH, SPEED = 0.102, 5.3


def solve(rows):
    with mp.workdps(60):
        system = mp.matrix([row[:-1] for row in rows])
        return mp.lu_solve(system, mp.matrix([row[-1] for row in rows]))


def level_pull(beta, mass, inertia, masses_above):
    """J from Eqs. 3, 4, S1 and S2, with the ends' velocities of S3 to S6.

    Unknowns: impulses F and N; changes of V_z, ω, V_z' and ω'; U_R and U_L. Upward is positive, and
    ω turns the right end up. The torques on all rods above turn them together: I' is their sum.
    """
    with mp.workdps(60):
        beta, v, half = mp.mpf(beta), mp.mpf(SPEED), mp.mpf(LENGTH) / 2
        m, total = mp.mpf(mass), mp.fsum(masses_above)
        i = mp.mpf(inertia) * m * half**2  # ξ = 4I/(mL²)
        i_above = mp.mpf(inertia) * total * half**2
        rows = [
            # F, N, ΔV_z, Δω, ΔV_z', Δω', U_R, U_L | right-hand side
            [1, 1, -m, 0, 0, 0, 0, 0, 0],  # Eq. 3
            [half, -half, 0, -i, 0, 0, 0, 0, 0],  # Eq. 4
            [1, 0, 0, 0, total, 0, 0, 0, 0],  # S1
            [half, 0, 0, 0, 0, i_above, 0, 0, 0],  # S2
            [0, 0, 1, -half, 0, 0, 0, 0, (1 + beta) * v],  # S3: −V → +βV
            [0, 0, 1, half, 0, 0, 1, 0, v],  # S4: −V → −U_R
            [0, 0, 0, 0, 1, half, 1, 0, v],  # S5: −V → −U_R
            [0, 0, 0, 0, 1, -half, 0, 1, v],  # S6: −V → −U_L
        ]
    return solve(rows)[0]


def inclined_pull(beta, mu, incline_deg, mass, inertia_y, inertia_z):
    """J from Eqs. S7 to S12 and f = μN.

    Unknowns: impulses N, f and F; changes of V_z, ω, V_y and ψ. The left end is struck: it moves
    at V_z − ωL/2 and, ψ being counted as S10 does, at V_y + ψL/2.
    """
    with mp.workdps(60):
        theta = mp.radians(mp.mpf(incline_deg))
        cos, sin = mp.cos(theta), mp.sin(theta)
        half, m, v, mu = mp.mpf(LENGTH) / 2, mp.mpf(mass), mp.mpf(SPEED), mp.mpf(mu)
        i_y, i_z = (mp.mpf(xi) * m * half**2 for xi in (inertia_y, inertia_z))
        rows = [
            # N, f, F, ΔV_z, Δω, ΔV_y, Δψ | right-hand side
            [cos, sin, 1, -m, 0, 0, 0, 0],  # S7
            [-half * cos, -half * sin, half, 0, -i_y, 0, 0, 0],  # S8
            [sin, -cos, 0, 0, 0, -m, 0, 0],  # S9
            [half * sin, -half * cos, 0, 0, 0, 0, -i_z, 0],  # S10
            [0, 0, 0, cos, -half * cos, sin, half * sin, (1 + mp.mpf(beta)) * v * cos],  # S11
            [0, 0, 0, 1, half, 0, 0, 0],  # S12
            [mu, -1, 0, 0, 0, 0, 0, 0],
        ]
    return solve(rows)[2]


@examples(60)
@given(chains(most=6), RESTITUTIONS, INERTIAS)
def test_rods_solve_the_equations_of_motion_on_the_level(chain, beta, xi):
    impact = impact_on(Surface(Quantity(beta), Quantity(0.2)), replace(chain, inertia=xi), 0.0)
    gains = kicks(chain, [impact.alpha] * chain.rods, impact.gamma)
    for k, gain in enumerate(gains[:-1]):
        m, rest = chain.masses[k], chain.masses[k + 1 :]
        wanted = float(level_pull(beta, m, xi, rest)) / SPEED
        # Eq. 9, and the gain that a fall is made of; α has the digits of 1 − ξ.
        loose = TIGHT / max(1.0 - xi, 1e-3)
        assert impact.alpha * m / (1.0 + impact.gamma * m / math.fsum(rest)) == pytest.approx(
            wanted, rel=loose, abs=1e-15 * m
        )
        assert gain * math.fsum(rest) == pytest.approx(wanted, rel=loose, abs=1e-15 * m)


@examples(80)
@given(RESTITUTIONS, SLIDING_FRICTIONS, INCLINES, st.floats(0.02, 0.98), INERTIAS)
def test_unlike_axes_solve_the_equations_of_motion(beta, mu, incline, inertia, inertia_z):
    """Eq. 13 with ξ_y ≠ ξ_z, for a chain of like rods."""
    wanted = float(inclined_pull(beta, mu, incline, 0.012, inertia, inertia_z) / 0.012 / SPEED)
    assert close(alpha_inclined(beta, mu, incline, inertia, inertia_z), wanted, TIGHT)
    if incline:  # of which cot θ is a number
        like = inclined_pull(beta, mu, incline, 0.012, inertia, inertia) / 0.012 / SPEED
        said = {"restitution": beta, "friction": mu, "inertia": inertia, "incline": incline}
        assert close(exact_coefficients(said)["alpha"], float(like), 1e-15)
    chain = replace(even_chain(3), inertia=inertia, inertia_z=inertia_z)
    impact = impact_on(Surface(Quantity(beta), Quantity(mu)), chain, incline)
    assert close(impact.alpha, wanted, TIGHT)
    # γ is about the horizontal axis and knows nothing of ξ_z.
    assert impact.gamma == gamma_finite(inertia)


def test_a_surface_of_which_no_friction_is_said_has_none():
    assert Surface(Quantity(0.2)) == Surface(Quantity(0.2), Quantity(0.0))
