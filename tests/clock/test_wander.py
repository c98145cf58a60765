"""A wandering rate: the estimate against dense matrices, and its intervals against the truth."""

import mpmath
import numpy as np
import pytest

from rig.clock.wander import Readings, Track
from tests.clock.clocks import HZ, Clock, compared, ppm, tick_rate


def readings(seed: int, n: int, span: float, walk: float = 0.0, epochs: int = 1) -> Readings:
    rng = np.random.default_rng(seed)
    at = np.sort(rng.uniform(0.0, span, n))
    clock = Clock(seed, walk=walk, last=int(span) + 2)
    sigma = rng.uniform(0.5e-4, 3e-4, n)
    epoch = np.minimum((at / span * epochs).astype(np.intp), epochs - 1)
    phase = np.interp(at, clock.times, clock.phases) + rng.normal(0.0, sigma) + 0.01 * epoch
    return Readings(at, phase, sigma, epoch)


@pytest.mark.parametrize("epochs", [1, 3])
def test_the_estimate_is_that_of_the_whole_covariance_in_40_digits(epochs):
    """Universal kriging as in any textbook, of the rate at a moment: no trick, no float."""
    given = readings(1, 24, 600.0, walk=200.0, epochs=epochs)
    track = Track(given)
    track.search()
    assert track.seen
    mpmath.mp.dps = 40
    t = [mpmath.mpf(float(x)) - float(given.at[0]) for x in given.at]
    n, when = len(t), mpmath.mpf(300) - float(given.at[0])
    q = mpmath.mpf(track.wander) ** 2

    def kernel(a, b):
        low, high = min(a, b), max(a, b)
        return q * low**2 * (3 * high - low) / 6

    def cross(x):
        return q * (x**2 / 2 if x <= when else when * x - when**2 / 2)

    scale2 = mpmath.mpf(track._scale2)
    v = mpmath.matrix(n, n)
    h = mpmath.matrix(n, epochs + 1)
    for i in range(n):
        for j in range(n):
            v[i, j] = kernel(t[i], t[j])
        v[i, i] += scale2 * mpmath.mpf(float(given.sigma[i])) ** 2
        h[i, int(given.epoch[i])] = 1
        h[i, epochs] = t[i]
    y = mpmath.matrix([float(x) for x in given.phase])
    c = mpmath.matrix([cross(x) for x in t])
    inverse = v**-1
    a = (h.T * inverse * h) ** -1
    beta = a * (h.T * inverse * y)
    value = beta[epochs] + (c.T * inverse * (y - h * beta))[0]
    direct = -(h.T * inverse * c)
    direct[epochs] += 1
    variance = q * when - (c.T * inverse * c)[0] + (direct.T * a * direct)[0]
    rate, u = track.rate(300.0)
    assert rate == pytest.approx(float(value), abs=1e-6 * u)
    assert u == pytest.approx(float(mpmath.sqrt(variance)), rel=1e-6)


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
