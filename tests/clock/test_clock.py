import random

import pytest

from rig.records import ClockSample
from tests.clock.clocks import tick_rate

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


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_samples_give_the_nominal_rate(count):
    rate = tick_rate(pings(random.Random(0), [1.0] * count, 0), HZ)
    assert (rate.hz, rate.n, rate.span_s) == (HZ, 0, 0.0)
    assert rate.u_hz == pytest.approx(HZ * 0.005 / 3**0.5)


def test_two_samples_at_the_same_time_say_nothing():
    (ping,) = pings(random.Random(0), [1.0], 0)
    rate, none = tick_rate([ping, ping], HZ), tick_rate([], HZ)
    assert (rate.hz, rate.u_hz, rate.n) == (none.hz, none.u_hz, 0)
