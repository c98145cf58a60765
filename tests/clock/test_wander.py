"""A wandering rate: the estimate against dense matrices, and its intervals against the truth."""

import numpy as np
import pytest

from tests.clock.clocks import HZ, Clock, compared, ppm, tick_rate


@pytest.mark.parametrize(
    ("walk", "drift", "span", "trials"),
    [(5.0, 0.0, 1200.0, 40), (100.0, 0.0, 600.0, 60), (0.0, 200.0, 900.0, 20)],
    ids=["steady", "wanders", "drifts"],
)
def test_the_rate_of_a_moment_lies_in_its_interval(walk, drift, span, trials):
    """95 % intervals at a random moment; 60 trials of 95 % give at least 52 in all but 1 %."""
    held = 0
    for seed in range(trials):
        clock = Clock(seed, walk=walk, drift=drift, last=int(span) + 10)
        rate = tick_rate(compared(clock, seed, span, every=3.0), HZ)
        at = span * np.random.default_rng(seed).uniform()
        hz, u_hz = rate.at(at)
        error = ppm(hz, clock.rate(at))
        held += abs(error) <= 1.96 * u_hz / HZ * 1e6
        # One line for all of the session would be off by far more.
        if drift:
            assert abs(error) < 8.0
            assert abs(ppm(rate.hz, clock.rate(0.0))) > 20.0
    assert held >= 0.86 * trials


def test_between_and_beyond_samples_a_wandering_rate_is_known_less():
    clock = Clock(3, walk=200.0, last=4000)
    pings = compared(clock, 3, 600.0) + compared(clock, 4, 600.0, begin=3000.0)
    rate = tick_rate(pings, HZ)
    u = [rate.at(at)[1] / HZ * 1e6 for at in (300.0, 1800.0, 3300.0, 3600.0, 7200.0)]
    assert u[0] < 10.0
    assert u[2] < 10.0
    assert u[1] > 5.0 * u[0]
    assert u[4] > 5.0 * u[3] > 5.0 * u[2] / 2.0
    assert u[4] == pytest.approx(200.0, rel=0.5)  # an hour of the walk
