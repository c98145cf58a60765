from __future__ import annotations

import random
import statistics

import pytest

from rig.clock.host import SystemClock
from rig.clock.rate import tick_rate
from rig.records import ClockSample

HZ = 16_000_000
BASE_S = 0.4e-3


def pings(rng, times, ppm, *, jitter=1e-3, offset=None, start=0.0) -> list[ClockSample]:
    hz = HZ * (1 + ppm * 1e-6)
    offset = rng.randrange(2**32) if offset is None else offset
    found = []
    for t in times:
        late = [rng.expovariate(1 / jitter) if jitter else 0.0 for _ in range(2)]
        tick = offset + (t - start + late[0] * 0.3 + BASE_S / 2) * hz
        done = t + BASE_S + late[0] * 0.3 + late[1]
        found.append(ClockSample(round(t * 1e9), round(done * 1e9), int(tick) % 2**32))
    return found


def error_ppm(rate, ppm) -> float:
    return (rate.hz / (HZ * (1 + ppm * 1e-6)) - 1) * 1e6


@pytest.mark.parametrize("ppm", [-5000, -37, 0, 4999])
def test_accuracy_after_a_minute(ppm):
    errors, pulls = [], []
    for seed in range(60):
        rng = random.Random(seed)
        rate = tick_rate(pings(rng, [0.5 * n for n in range(121)], ppm), HZ)
        errors.append(error_ppm(rate, ppm))
        pulls.append(errors[-1] / (rate.u_hz / HZ * 1e6))
    assert max(map(abs, errors)) <= 5
    assert 0.6 < statistics.pstdev(pulls) < 1.4  # the uncertainty is neither boast nor fear


@pytest.mark.parametrize("n", [2, 3, 5, 10])
def test_uncertainty_is_honest_with_few_samples(n):
    inside = 0
    for seed in range(200):
        rng = random.Random(seed)
        rate = tick_rate(pings(rng, [3.0 * k for k in range(n)], 1234), HZ)
        inside += abs(error_ppm(rate, 1234)) < 2 * rate.u_hz / HZ * 1e6
    assert inside >= 180


def test_gaps_of_an_hour_and_many_wraps():
    rng = random.Random(5)
    times = [h * 3600.0 + 0.5 * k for h in range(6) for k in range(4)]
    for ppm in (-5500, 5500):
        rate = tick_rate(pings(rng, times, ppm), HZ)
        assert rate.n >= 20
        assert rate.span_s > 17_000
        assert abs(error_ppm(rate, ppm)) < 0.2


def test_after_a_whole_night_the_wraps_are_not_guessed():
    rng = random.Random(6)
    times = [k * 0.5 for k in range(60)] + [40_000 + k * 0.5 for k in range(60)]
    rate = tick_rate(pings(rng, times, 3000), HZ)
    assert rate.span_s == pytest.approx(59, abs=1)
    assert abs(error_ppm(rate, 3000)) < 6


@pytest.mark.parametrize("told", [True, False])
def test_a_reset_between_samples_does_no_harm(told):
    for seed in range(20):
        rng = random.Random(seed)
        one = pings(rng, [0.5 * n for n in range(60)], 700)
        two = pings(rng, [35 + 0.5 * n for n in range(60)], 700, offset=12345, start=34)
        boots = [34_000_000_000] if told else []
        rate = tick_rate(one + two, HZ, boots)
        assert abs(error_ppm(rate, 700)) < 6
        assert rate.span_s == pytest.approx(59, abs=0.1)


def test_outliers_are_left_out():
    rng = random.Random(1)
    good = pings(rng, [0.5 * n for n in range(120)], 50)
    bad = list(good)
    # On fast round trips, where so much delay cannot be explained.
    for n in sorted(range(120), key=lambda n: good[n].host_recv_ns - good[n].host_send_ns)[:3]:
        ping = bad[n]
        bad[n] = ping._replace(tick=(ping.tick + 30_000) % 2**32)
    rate = tick_rate(bad, HZ)
    assert rate.n <= 117
    assert abs(error_ppm(rate, 50)) < 5


def test_order_does_not_matter():
    samples = pings(random.Random(2), [0.5 * n for n in range(50)], 50)
    assert tick_rate(samples[::-1], HZ) == tick_rate(samples, HZ)


def test_without_jitter_it_is_exact():
    samples = pings(random.Random(2), [0.5 * n for n in range(100)], 50, jitter=0)
    assert abs(error_ppm(tick_rate(samples, HZ), 50)) < 0.001


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_samples_give_the_nominal_rate(count):
    rate = tick_rate(pings(random.Random(0), [1.0] * count, 0), HZ)
    assert (rate.hz, rate.n, rate.span_s) == (HZ, 0, 0.0)
    assert rate.u_hz == pytest.approx(HZ * 0.005 / 3**0.5)


def test_two_samples_at_the_same_time_say_nothing():
    (ping,) = pings(random.Random(0), [1.0], 0)
    rate, none = tick_rate([ping, ping], HZ), tick_rate([], HZ)
    assert (rate.hz, rate.u_hz, rate.n) == (none.hz, none.u_hz, 0)


def test_the_system_clock_is_monotonic():
    clock = SystemClock()
    before = clock.now_ns()
    clock.sleep(0.001)
    assert clock.now_ns() - before >= 1_000_000
