"""M/λ of the density profiles, exactly or in many digits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.density import Exponential, Uniform, pull
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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Uniform(0.0), "length_m"),
        (lambda: Exponential(math.inf, 1.0), "length_m"),
        (lambda: Exponential(1.0, math.nan), "decades"),
        (lambda: Exponential(1.0, -301.0), "decades"),
    ],
)
def test_says_what_is_wrong_with_a_profile(make, message):
    with pytest.raises(DomainError, match=message):
        make()
