"""The rate from few samples, and over gaps."""

import pytest

from tests.clock.clocks import HZ, Clock, compared, ppm, tick_rate


@pytest.mark.parametrize("n", [2, 3, 5, 10])
def test_uncertainty_is_honest_with_few_samples(n):
    inside = 0
    for seed in range(200):
        rate = tick_rate(compared(Clock(seed, last=60), seed, 50.0, every=3.0)[:n], HZ)
        inside += abs(ppm(rate.hz, -1300e-6)) < 2 * rate.u_hz / HZ * 1e6
    assert inside >= 180


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


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_samples_give_the_nominal_rate(count):
    rate = tick_rate(compared(Clock(0, last=9), 0, 1.0)[:count], HZ)
    assert (rate.hz, rate.n, rate.span_s) == (HZ, 0, 0.0)
    assert rate.u_hz == pytest.approx(HZ * 0.005 / 3**0.5)


def test_two_samples_at_the_same_time_say_nothing():
    ping, *_ = compared(Clock(0, last=9), 0, 1.0)
    rate, none = tick_rate([ping, ping], HZ), tick_rate([], HZ)
    assert (rate.hz, rate.u_hz, rate.n) == (none.hz, none.u_hz, 0)
