"""Coverage factors and tails of χ² against incomplete beta and gamma functions in 30 digits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from rig.analysis.distributions import COVERAGE_95, chi2_tail, coverage_factor
from tests.examples import examples


def covered(k, degrees) -> mpf:
    """P(|t| < k) = 1 − I_x(ν/2, ½) with x = ν/(ν + k²)."""
    with mp.workdps(30):
        nu, k = mpf(degrees), mpf(k)
        x = nu / (nu + k * k)
        # For x near 1 mpmath's series is slow; the complement I_{1−x}(½, ν/2) is the same number.
        return mp.betainc(mpf("0.5"), nu / 2, 0, 1 - x, regularized=True)


def assert_covers(degrees: float, probability: float) -> None:
    k = coverage_factor(degrees, probability)
    assert abs(float(covered(k, degrees) - mpf(probability))) < 1e-13


@pytest.mark.parametrize("degrees", [1, 1.5, 2, 2.7, 3, 5, 10.3, 30, 100, 1234.5, 1e4, 1e5])
@pytest.mark.parametrize("probability", [0.5, 0.6827, 0.95, 0.99])
def test_the_factor_covers_what_it_says(degrees, probability):
    assert_covers(degrees, probability)


@examples(60)
@given(st.floats(0, 5).map(lambda exponent: 10.0**exponent))
def test_any_real_number_of_degrees(degrees):
    assert_covers(degrees, 0.95)


def test_infinitely_many_degrees_are_the_normal_distribution():
    normal = float(mp.sqrt(2) * mp.erfinv(mpf("0.95")))
    # It is taken at ν = 10⁶, where t exceeds the normal quantile by (z² + 1)/4ν to first order.
    excess = (normal**2 + 1) / 4e6
    assert coverage_factor(math.inf) / normal - 1 == pytest.approx(excess, rel=1e-5)
    assert coverage_factor(1e9) == coverage_factor(math.inf)
    assert normal == pytest.approx(COVERAGE_95, rel=1e-15)


@pytest.mark.parametrize("degrees", [0.999, 0.0, -3.0, -math.inf, math.nan])
def test_fewer_than_one_degree_is_refused(degrees):
    with pytest.raises(ValueError, match="degrees of freedom"):
        coverage_factor(degrees)


@pytest.mark.parametrize("degrees", [1, 2, 3, 9, 24, 207, 1001])
def test_the_tail_of_chi2(degrees):
    """Q(ν/2, x/2), far out too, where 1 − P would be nothing but rounding."""
    for x in (1e-3, 1.0, degrees, 3.0 * degrees, 700.0):
        with mp.workdps(30):
            expected = mp.gammainc(mpf(degrees) / 2, mpf(x) / 2, regularized=True)
        assert chi2_tail(x, degrees) == pytest.approx(float(expected), rel=1e-11, abs=1e-300)
    assert chi2_tail(0.0, degrees) == 1.0


def test_a_fit_that_is_better_by_rounding_is_no_misfit():
    assert chi2_tail(-1e-12, 1) == 1.0


@pytest.mark.parametrize("degrees", [0, -1])
def test_no_chi2_without_degrees(degrees):
    with pytest.raises(ValueError, match="at least 1"):
        chi2_tail(1.0, degrees)
