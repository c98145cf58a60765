"""The paper's camera beside the fall: how far it is off, and why."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.camera import FRAME_RATE_HZ, POSITION_NOISE_M, camera_reading

HIT = 0.5
SPEED = 6.93
RISE = 2.0  # speed at which the tops part, m/s
SEPARATION = 0.115
N = 4000
SIGMAS = 5.0


def impact_top(time: float) -> float:
    return SPEED * (HIT - time)


def free_top(time: float) -> float:
    return SEPARATION + (SPEED - RISE) * (HIT - time)


@pytest.fixture(scope="module")
def readings() -> np.ndarray:
    rng = np.random.default_rng(5)
    return np.array([camera_reading(impact_top, free_top, HIT, rng) for _ in range(N)])


def test_the_last_frame_before_the_hit_is_half_a_frame_early_on_average(readings):
    low = SEPARATION - readings[:, 0]
    span = RISE / FRAME_RATE_HZ  # 4.2 mm in a frame
    noise = math.sqrt(2) * POSITION_NOISE_M  # of two tops
    scatter = math.hypot(span / math.sqrt(12), noise)
    assert abs(low.mean() - span / 2) < SIGMAS * scatter / math.sqrt(N)
    assert low.std() == pytest.approx(scatter, rel=SIGMAS / math.sqrt(N))
    assert low.min() > -6 * noise
    assert low.max() < span + 6 * noise


def test_speed_is_a_line_through_four_frames(readings):
    # The slope's scatter: σ / √Σ(t − t̄)² with frames at ±½ and ±1½ of their distance.
    scatter = POSITION_NOISE_M * FRAME_RATE_HZ / math.sqrt(0.5**2 * 2 + 1.5**2 * 2)
    assert scatter == pytest.approx(0.11, abs=0.005)  # as in physics.md
    errors = readings[:, 1] - SPEED
    assert abs(errors.mean()) < SIGMAS * scatter / math.sqrt(N)
    assert errors.std() == pytest.approx(scatter, rel=SIGMAS / math.sqrt(2 * N))
