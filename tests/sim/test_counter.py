"""The virtual resonator: exact while steady, and as unsteady as it is said to be."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.counter import Counter

HZ = 16_000_000
HOUR = 3600 * 10**9


@given(when=st.integers(0, 10**17), start=st.integers(0, 2**32 - 1))
def test_a_steady_counter_is_exact_over_years(when, start):
    counter = Counter(HZ, -1300.0, start)
    exact = start + Fraction(when * HZ, 10**9) * (1 - Fraction(1300, 10**6))
    assert counter.tick_at(when) == int(exact) % 2**32


def test_drift_is_what_an_hour_changes():
    counter = Counter(HZ, 100.0, 0, drift_ppm=50.0)
    assert counter.hz(0) == HZ * (1 + 100e-6)
    assert counter.hz(HOUR) == pytest.approx(HZ * (1 + 150e-6), rel=1e-12)
    assert counter.hz(3 * HOUR) == pytest.approx(HZ * (1 + 250e-6), rel=1e-12)


def test_wander_is_the_scatter_after_an_hour():
    """Standard deviation of 400 walks: within 12 % of the true one in all but 1 of 1000."""
    ends = [
        (Counter(HZ, 0.0, 0, wander_ppm=20.0, seed=seed).hz(HOUR) / HZ - 1.0) * 1e6
        for seed in range(400)
    ]
    assert np.std(ends) == pytest.approx(20.0, rel=0.12)
    assert abs(np.mean(ends)) < 3.3 * 20.0 / 20.0
