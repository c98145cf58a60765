"""A wandering rate: the estimate against dense matrices, and its intervals against the truth."""

import numpy as np
import pytest

from rig.clock.wander import Readings, Track
from tests.clock.clocks import HZ, Clock, compared, ppm, tick_rate


@pytest.mark.parametrize("epochs", [1, 3])
def test_the_estimate_is_that_of_the_whole_covariance(epochs):
    """Universal kriging as in any textbook, of the rate at a moment, in s and without a trick."""
    rng, n, span = np.random.default_rng(1), 24, 600.0
    at, sigma = np.sort(rng.uniform(0.0, span, n)), rng.uniform(0.5e-4, 3e-4, n)
    clock, epoch = Clock(1, walk=200.0, last=602), (np.linspace(0.0, 0.99, n) * epochs).astype(int)
    phase = np.interp(at, clock.times, clock.phases) + rng.normal(0.0, sigma) + 0.01 * epoch
    track = Track(Readings(at, phase, sigma, epoch))
    track.search()
    assert track.seen
    t, when, q = at - at[0], 300.0 - at[0], track.wander**2
    low, high = np.minimum.outer(t, t), np.maximum.outer(t, t)
    inverse = np.linalg.inv(q * low**2 * (3 * high - low) / 6 + np.diag(track._scale2 * sigma**2))
    design = np.column_stack([*(epoch == number for number in range(epochs)), t])
    cross = q * np.where(t <= when, t**2 / 2, when * t - when**2 / 2)
    of_beta = np.linalg.inv(design.T @ inverse @ design)
    beta = of_beta @ design.T @ inverse @ phase
    direct = np.eye(epochs + 1)[-1] - design.T @ inverse @ cross
    value = beta[-1] + cross @ inverse @ (phase - design @ beta)
    variance = q * when - cross @ inverse @ cross + direct @ of_beta @ direct
    rate, u = track.rate(300.0)
    assert rate == pytest.approx(value, abs=1e-6 * u)
    assert u == pytest.approx(np.sqrt(variance), rel=1e-6)


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
