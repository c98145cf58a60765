"""Coverage factors and tails of χ² against incomplete beta and gamma functions in 30 digits."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from mpmath import mp, mpf

from rig.analysis.budget_lines import effective_degrees
from rig.analysis.distributions import chi2_tail, coverage_factor
from rig.units import COVERAGE_95
from tests.examples import examples
from tests.refusals import refused


def covered(k, degrees) -> mpf:
    """P(|t| < k) = 1 − I_x(ν/2, ½) with x = ν/(ν + k²)."""
    with mp.workdps(30):
        nu, k = mpf(degrees), mpf(k)
        x = nu / (nu + k * k)
        # For x near 1 mpmath's series is slow; the complement I_{1−x}(½, ν/2) is the same number.
        return mp.betainc(mpf("0.5"), nu / 2, 0, 1 - x, regularized=True)


@examples(60)
@given(st.floats(0, 5).map(lambda exponent: 10.0**exponent), st.sampled_from([0.5, 0.95, 0.99]))
@example(1.0, 0.95)
def test_the_factor_covers_what_it_says(degrees, probability):
    """For any real number of degrees of freedom."""
    assert abs(float(covered(coverage_factor(degrees, probability), degrees) - probability)) < 1e-13


def test_infinitely_many_degrees_are_the_normal_distribution():
    normal = pytest.approx(float(mp.sqrt(2) * mp.erfinv(mpf("0.95"))), rel=1e-15)
    assert coverage_factor(math.inf) == normal == COVERAGE_95


@pytest.mark.parametrize("degrees", [0.999, 0.0, -3.0, -math.inf, math.nan])
def test_fewer_than_one_degree_is_refused(degrees):
    for function in (coverage_factor, lambda nu: chi2_tail(1.0, nu)):
        refused(ValueError, "degrees of freedom; at least 1", function, degrees)


@pytest.mark.parametrize("degrees", [1, 2, 3, 9, 24, 207, 1001])
def test_the_tail_of_chi2(degrees):
    """Q(ν/2, x/2), far out too, where 1 − P would be nothing but rounding."""
    for x in (1e-3, 1.0, degrees, 3.0 * degrees, 700.0):
        with mp.workdps(30):
            expected = mp.gammainc(mpf(degrees) / 2, mpf(x) / 2, regularized=True)
        assert chi2_tail(x, degrees) == pytest.approx(float(expected), rel=1e-11, abs=1e-300)
    # A fit that is better by rounding is no misfit.
    assert chi2_tail(0.0, degrees) == chi2_tail(-1e-12, degrees) == 1.0


def test_an_end_gauge_has_the_degrees_of_freedom_of_the_gum():
    """GUM (JCGM 100), H.1.6: components in nm, ν_eff = 16.7, taken as 16; U for 99 % is 93 nm."""
    budget = {"standard": 25.0, "comparison": 9.7, "expansion": 2.9, "temperature": 16.6}
    u = math.hypot(*budget.values())
    assert u == pytest.approx(32.0, abs=0.5)
    degrees = effective_degrees(
        u, budget, {"standard": 18.0, "comparison": 25.6, "expansion": 50.0, "temperature": 2.0}
    )
    assert degrees == pytest.approx(16.7, abs=0.1)
    assert coverage_factor(math.floor(degrees), 0.99) * 32.0 == pytest.approx(93.0, abs=0.5)
