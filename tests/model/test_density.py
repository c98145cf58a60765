"""M/λ of the density profiles, exactly or in many digits."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.density import Exponential, Tabulated, Uniform, pull
from tests.examples import examples
from tests.model.chains import close, decades

SHARES = st.one_of(st.just(0.0), decades(-15, 0), st.just(1.0))


@given(decades(-3, 3), SHARES, decades(-12, 3))
def test_an_even_density_has_its_length_above(length, share, reach):
    z = share * length
    assert Uniform(length).mass_over_density(z) == z
    assert pull(Uniform(length), z, reach) == 1.0 / (z + reach)
    assert Exponential(length, 0.0).mass_over_density(z) == z


@examples(100)
@given(
    decades(-3, 3),
    SHARES,
    st.one_of(st.floats(1.0, 300.0), decades(-15, 5), decades(-15, 2.47).map(lambda d: -d)),
)
def test_an_exponential_density_over_any_number_of_decades(length, share, decades_):
    z = share * length
    found = Exponential(length, decades_).mass_over_density(z)
    with mp.workdps(60):
        rate = mp.mpf(decades_) * mp.log(10) / mp.mpf(length)
        wanted = -mp.expm1(-rate * mp.mpf(z)) / rate
    # e^700 multiplies a rounding of its exponent by 700.
    assert close(found, float(wanted), 1e-15 * (4.0 + 3.0 * max(0.0, -decades_)))


def test_an_exponential_density_does_not_overflow():
    steep = Exponential(1.0, 1e6)
    assert steep.mass_over_density(1.0) == pytest.approx(1 / (1e6 * math.log(10)), rel=1e-15)
    assert math.isfinite(Exponential(1.0, -300.0).mass_over_density(1.0))


@st.composite
def tables(draw):
    count = draw(st.integers(2, 8))
    gaps = draw(st.lists(decades(-4, 1), min_size=count - 1, max_size=count - 1))
    densities = draw(st.lists(decades(-8, 8), min_size=count, max_size=count))
    return Tabulated(tuple(accumulate(gaps, initial=0.0)), tuple(densities))


def exact_mass_over_density(table, z):
    z, mass = Fraction(z), Fraction(0)
    points = [
        (Fraction(a), Fraction(b)) for a, b in zip(table.distances, table.densities, strict=True)
    ]
    for (a, low), (b, high) in pairwise(points):
        here = low + (high - low) * (min(z, b) - a) / (b - a)
        mass += (low + here) / 2 * (min(z, b) - a)
        if z <= b:
            return mass / here
    raise AssertionError


@examples(100)
@given(tables(), SHARES)
def test_a_table_is_joined_by_straight_lines(table, share):
    z = share * table.length_m
    assert close(table.mass_over_density(z), float(exact_mass_over_density(table, z)), 1e-14)
    for kink in table.kinks:
        wanted = float(exact_mass_over_density(table, kink))
        assert close(table.mass_over_density(kink), wanted, 1e-14)


@given(tables(), SHARES, decades(-100, 100))
def test_the_unit_of_density_does_not_matter(table, share, unit):
    other = Tabulated(table.distances, tuple(unit * value for value in table.densities))
    z = share * table.length_m
    assert close(other.mass_over_density(z), table.mass_over_density(z), 1e-14)


def test_tables_compare_by_their_points():
    one, other = (Tabulated((0.0, 1.0, 2.0), (1.0, 2.0, 5.0)) for _ in range(2))
    assert one == other
    assert hash(one) == hash(other)
    assert one.kinks == (1.0,)
    assert one.length_m == 2.0
    assert "masses" not in repr(one)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Uniform(0.0), "length_m"),
        (lambda: Exponential(math.inf, 1.0), "length_m"),
        (lambda: Exponential(1.0, math.nan), "decades"),
        (lambda: Exponential(1.0, -301.0), "decades"),
        (lambda: Tabulated((0.0,), (1.0,)), "at least two"),
        (lambda: Tabulated((0.0, 1.0), (1.0,)), "as many"),
        (lambda: Tabulated((0.1, 1.0), (1.0, 1.0)), "rise from 0"),
        (lambda: Tabulated((0.0, 1.0, 1.0), (1.0, 1.0, 1.0)), "rise from 0"),
        (lambda: Tabulated((0.0, math.nan), (1.0, 1.0)), "rise from 0"),
        (lambda: Tabulated((0.0, 1.0), (1.0, 0.0)), "above zero"),
        (lambda: Tabulated((0.0, 1.0), (1.0, math.inf)), "above zero"),
    ],
)
def test_says_what_is_wrong_with_a_profile(make, message):
    with pytest.raises(DomainError, match=message):
        make()
