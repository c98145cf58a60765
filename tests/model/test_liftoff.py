"""Lift-off against Eqs. 3 and 4 with S18 and S19, and the height of a fountain."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import DomainError
from rig.model.impact import alpha_level
from rig.model.liftoff import alpha_from_fountain, alpha_liftoff, fountain_height
from tests.model.chains import decades


@given(st.floats(-1.0, 1.0), st.floats(0.0, 1.0))
def test_equation_s20_solves_the_equations_of_motion(restitution, inertia):
    """For m = V = 1 and L = 2 (so I = ξ): the right end goes to 1 + β', the left end stays.

    N + F = ΔV_z (Eq. 3) and F − N = ξ Δω (Eq. 4), both changes being (1 + β')/2.
    """
    change = (1 + Fraction(restitution)) / 2
    push = (change - Fraction(inertia) * change) / 2
    assert abs(Fraction(alpha_liftoff(restitution, inertia)) - push) < Fraction(1, 10**15)


def test_the_papers_value():
    assert alpha_liftoff() == pytest.approx(1 / 6, rel=1e-15)
    assert f"{alpha_liftoff():.2f}" == "0.17"
    assert alpha_liftoff(0.3, 0.2) == alpha_level(0.3, 0.2)  # the form of Eq. 8


@given(st.floats(0.0, 0.99), decades(-3, 3))
def test_height_and_alpha_are_inverse(alpha, below):
    above = fountain_height(alpha, below)
    assert above >= 0.0
    assert alpha_from_fountain(above, below) == pytest.approx(alpha, rel=1e-14)


def test_bead_chains():
    assert alpha_from_fountain(0.25, 2.0) == pytest.approx(1 / 9, rel=1e-15)
    assert alpha_from_fountain(0.0, 2.0) == 0.0


def test_fountains_that_cannot_be():
    for above, below in ((-0.1, 1.0), (0.1, 0.0), (0.1, -1.0)):
        with pytest.raises(DomainError, match="no fountain"):
            alpha_from_fountain(above, below)
    for alpha in (-0.1, 1.0, 2.0):
        with pytest.raises(DomainError, match="no steady fountain"):
            fountain_height(alpha, 1.0)
    assert fountain_height(0.5, 1.0) == 1.0
