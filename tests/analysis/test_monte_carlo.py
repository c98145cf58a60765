"""JCGM 101 beside the GUM budget: the same inputs, nothing linearised."""

import math

import numpy as np
import pytest

from rig.analysis.monte_carlo import TrialStats, agreement, monte_carlo
from tests.analysis.sessions import cases, fits

TRIALS = 150


def test_both_ways_agree():
    """χ² of 149, once in 10⁴ each side: u within factors 0.78 and 1.23; the mean within 4 SE."""
    (one,) = cases((1,), seed=6)
    (fit,) = fits([one])
    found = monte_carlo(fit, TRIALS, seed=1)
    quantities = one.analyze().quantities
    assert found.keys() == quantities.keys()
    for name, measured in quantities.items():
        propagated = found[name]
        assert 0.78 < propagated.u / measured.u < 1.23, name
        assert abs(propagated.mean - measured.value) < 4 * measured.u / math.sqrt(TRIALS), name


@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_intervals_agree_as_their_ends_do(shift):
    """Half a unit of the first digit of u is 12.5 % of u here; 10⁶ trials are good for 0.5 %."""
    drawn = TrialStats(5.0, 0.004, 5.0 - 1.959964 * 0.004, 5.0 + 1.959964 * 0.004)
    found = agreement(5.0 + shift * 0.004, 0.004, drawn, 10**6)
    assert found == {
        "d_low": pytest.approx(shift * 0.004, abs=1e-8),
        "d_high": pytest.approx(shift * 0.004, abs=1e-8),
        "tolerance": pytest.approx(0.0005),
        "error": pytest.approx(0.0054 * 0.004, rel=0.01),
        "agrees": shift == 0.0,
        "decided": True,
    }
    assert not agreement(5.0 + shift * 0.004, 0.004, drawn, 100)["decided"]


M = 10**6


def _sum(kind, rng):
    """JCGM 101, 9.2: four normal inputs, four rectangular, and one of these ten times wider."""
    if kind == "normal":
        return rng.normal(size=(4, M)).sum(axis=0)
    half = math.sqrt(3.0) * np.array([1.0, 1.0, 1.0, 10.0 if kind == "one is wider" else 1.0])
    return (half[:, None] * rng.uniform(-1.0, 1.0, (4, M))).sum(axis=0)


@pytest.mark.parametrize(
    ("kind", "u", "end", "validated"),
    # Tables 2 to 4: u and the end of the symmetric 95 % interval, to the digits given there.
    [
        ("normal", 2.0, 3.92, True),
        ("rectangular", 2.0, 3.88, True),
        ("one is wider", 10.1, 17.0, False),
    ],
)
def test_sums_of_jcgm_101(kind, u, end, validated):
    drawn = TrialStats.of(_sum(kind, np.random.default_rng(5)))
    last = 0.1 if kind == "one is wider" else 0.01
    assert drawn.u == pytest.approx(u, abs=0.05)
    assert (-drawn.low, drawn.high) == pytest.approx((end, end), abs=0.5 * last + 2 * 2.7e-3 * u)
    found = agreement(0.0, u if kind != "one is wider" else math.sqrt(103.0), drawn, M, digits=2)
    # 3.92 and 3.88 are so near to δ = 0.05 apart that this many trials do not tell.
    assert found["decided"] == (kind != "rectangular")
    assert found["agrees"] == validated
