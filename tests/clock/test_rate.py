"""The tick rate, steady or wandering, against the truth and against independent least squares."""

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.clock.wander import Readings, Track
from tests.clock.clocks import DELAYS, HZ, Clock, compared, moved, ppm, tick_rate
from tests.examples import examples

TRIALS = 60


def errors(delay, trials=TRIALS, span=60.0, **clock):
    """Error and standard uncertainty of the mean rate, ppm, and samples left out."""
    found = []
    for seed in range(trials):
        board = Clock(seed, last=int(span) + 10, **clock)
        pings = compared(board, seed, span, delay=delay)
        rate = tick_rate(pings, HZ)
        true = board.mean(pings[-1].host_recv_ns * 1e-9, pings[0].host_recv_ns * 1e-9)
        found.append((ppm(rate.hz, true), rate.u_hz / HZ * 1e6, rate.outliers))
    return np.array(found).T


@pytest.mark.parametrize("delay", DELAYS.values(), ids=DELAYS)
def test_after_a_minute_the_rate_is_known_to_5_ppm_and_its_uncertainty_is_true(delay):
    error, u, _ = errors(delay)
    assert np.abs(error).max() <= 5.0
    assert u.max() <= 5.0
    from scipy.stats import binom  # takes half a second, which collecting need not

    fewest = binom.ppf(0.001, TRIALS, 0.95)  # of intervals that hold 95 %
    assert (np.abs(error) <= 1.96 * u).sum() >= fewest
    assert u.mean() < 1.6 * error.std(), "nor is it far too careful"


@pytest.mark.parametrize("walk", [0.0, 20.0, 300.0])
def test_what_no_delay_explains_is_left_out_also_while_the_rate_wanders(walk):
    rng = random.Random(3)
    for seed in range(5):
        board = Clock(seed, walk=walk, last=700)
        pings = compared(board, seed, 600.0)
        odd = rng.sample(range(10, len(pings) - 10), 5)
        for n in odd:  # on fast trips, where nothing excuses it
            ping = pings[n]
            fast = ping._replace(host_recv_ns=ping.host_send_ns + 500_000)
            pings[n] = fast._replace(tick=(board.tick(ping.host_send_ns * 1e-9) + 30_000) % 2**32)
        rate = tick_rate(pings, HZ)
        assert 5 <= rate.outliers <= 7
        hz, u_hz = rate.at(300.0)
        assert abs(ppm(hz, board.rate(300.0))) < 4.0 * u_hz / HZ * 1e6


SAMPLES = compared(Clock(4, last=100), 4, 50.0)
RATE = tick_rate(SAMPLES, HZ)


@examples(30)
@given(
    shift=st.integers(-(10**16), 10**17),
    offset=st.integers(0, 2**32 - 1),
    order=st.randoms(use_true_random=False),
)
def test_neither_hour_nor_count_nor_order_matters(shift, offset, order):
    """Host clocks begin anywhere, counters too, and a file may be sorted as it likes."""
    others = [moved(p, shift)._replace(tick=(p.tick + offset) % 2**32) for p in SAMPLES]
    order.shuffle(others)
    rate = tick_rate(others, HZ)
    assert (rate.n, rate.outliers) == (RATE.n, RATE.outliers)
    assert abs(rate.hz - RATE.hz) < 1e-3 * RATE.u_hz
    assert rate.u_hz == pytest.approx(RATE.u_hz, rel=1e-3)


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_samples_give_the_nominal_rate(count):
    rate = tick_rate(compared(Clock(0, last=9), 0, 1.0)[:count], HZ)
    assert (rate.hz, rate.n, rate.span_s) == (HZ, 0, 0.0)
    assert rate.u_hz == pytest.approx(HZ * 0.005 / 3**0.5)


@pytest.mark.parametrize("off", [-5500.0, 5500.0])
def test_gaps_of_an_hour_and_many_wraps(off):
    clock = Clock(5, ppm=off, last=19_000)
    pings = [ping for hour in range(6) for ping in compared(clock, hour, 2.0, begin=3600.0 * hour)]
    rate = tick_rate(pings, HZ)
    assert rate.n >= 20
    assert rate.span_s > 17_000
    assert abs(ppm(rate.hz, off * 1e-6)) < 0.2


def test_after_a_whole_night_the_wraps_are_not_guessed():
    clock = Clock(6, ppm=3000.0, last=41_000)
    rate = tick_rate(compared(clock, 1, 30.0) + compared(clock, 2, 30.0, begin=40_000.0), HZ)
    assert rate.span_s == pytest.approx(59, abs=1.5)
    assert abs(ppm(rate.hz, 3000e-6)) < 6


def test_two_samples_at_the_same_time_say_nothing():
    ping, *_ = compared(Clock(0, last=9), 0, 1.0)
    rate, none = tick_rate([ping, ping], HZ), tick_rate([], HZ)
    assert (rate.hz, rate.u_hz, rate.n) == (none.hz, none.u_hz, 0)


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
