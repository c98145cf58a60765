"""The paper's camera: what it makes of a fall, and how far off that is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from statistics import StatisticsError, fmean, stdev

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.model.chain import Chain
from rig.model.fall import free_fall_speed, kicks
from rig.model.impact import alpha_inclined, gamma_finite
from rig.model.motion import Motion
from sim.camera import FRAME_RATE_HZ, SPEED_FRAMES, frame_times, read_frames
from tests.examples import examples
from tests.model.chains import even_chain

FRAME = 1.0 / 480.0
DROP, GRAVITY = 0.18, 9.81
GAMMA = gamma_finite(1 / 3)
SPEEDS = st.floats(0.1, 20.0)
RATES = st.floats(24.0, 1e5)


def motion_at(incline_deg, chain=None):
    chain = chain or even_chain(25)
    gains = kicks(chain, [alpha_inclined(0.5, 0.2, incline_deg)] * chain.rods, GAMMA)
    return Motion(chain, gains, DROP, GRAVITY)


def tops(motion):
    """Heights of the two top rods against time."""
    length = motion.chain.length

    def struck(time):
        return motion.at(time).height_m + length

    def free(time):
        return struck(time) + motion.at(time).separation_m

    return struck, free


@dataclass(frozen=True)
class Scatter:
    """Means of many readings, and half a standard deviation, which the paper draws as bars."""

    separation_m: float
    separation_bar: float
    speed_m_s: float
    speed_bar: float


def film(struck, free, hit_s, phases=48, rate_hz=FRAME_RATE_HZ):
    """Film one fall many times, the frames falling evenly over all phases."""
    readings = []
    for number in range(phases):
        times = frame_times(hit_s, (number + 0.5) / phases, rate_hz)
        readings.append(read_frames(times, [struck(t) for t in times], free(times[0])))
    separations = [reading.separation_m for reading in readings]
    speeds = [reading.speed_m_s for reading in readings]
    return Scatter(fmean(separations), 0.5 * stdev(separations), fmean(speeds), 0.5 * stdev(speeds))


def filmed(motion, **how):
    return film(*tops(motion), motion.end_s, **how)


PAPERS = motion_at(40.0)
END = PAPERS.at(PAPERS.end_s)


def test_it_is_the_papers_camera():
    assert (FRAME_RATE_HZ, SPEED_FRAMES) == (480.0, 4)


@given(st.floats(0.0, 1.0), RATES)
def test_the_last_frames_before_the_impact(phase, rate):
    times = frame_times(0.5, phase, rate)
    assert len(times) == 4
    assert times[0] == pytest.approx(0.5 - phase / rate, abs=1e-15)
    assert [a - b for a, b in pairwise(times)] == pytest.approx([1 / rate] * 3, abs=1e-15)
    assert max(times) <= 0.5


@given(SPEEDS, st.floats(-2.0, 2.0), st.floats(0.0, 1.0), RATES)
def test_a_straight_line_gives_the_exact_speed(speed, separation, phase, rate):
    times = frame_times(0.5, phase, rate)
    reading = read_frames(times, [speed * (0.5 - t) for t in times], 1.0 + separation)
    # A slope from heights that are rounded over a time of three frames.
    assert reading.speed_m_s == pytest.approx(speed, rel=1e-13 + 1e-15 * rate)
    assert reading.separation_m == pytest.approx(1.0 + separation - speed * phase / rate, abs=1e-13)


@examples(40)
@given(SPEEDS, st.floats(-1.0, 1.0), st.floats(0.01, 0.2))
def test_a_film_of_straight_lines(speed, parting, separation):
    """V is exact and does not scatter; Δz is half a frame's parting low, spread evenly over one."""
    phases = 48
    seen = film(
        lambda t: speed * (0.5 - t),
        lambda t: separation + (speed - parting) * (0.5 - t),
        0.5,
        phases,
    )
    assert seen.speed_m_s == pytest.approx(speed, rel=1e-12)
    assert seen.speed_bar < 1e-11 * speed
    assert seen.separation_m == pytest.approx(separation - parting * FRAME / 2, abs=1e-13)
    steps = abs(parting) * FRAME * stdev((k + 0.5) / phases for k in range(phases))
    assert seen.separation_bar == pytest.approx(steps / 2, abs=1e-13)


@examples(40)
@given(st.lists(st.floats(-0.1, 0.1), min_size=4, max_size=4), st.floats(0.0, 1.0))
def test_the_line_is_that_of_least_squares(heights, phase):
    times = frame_times(0.5, phase)
    slope = np.polyfit(np.array(times) - 0.49, heights, 1)[0]
    assert read_frames(times, heights, 0.0).speed_m_s == pytest.approx(-slope, rel=1e-9, abs=1e-9)


def test_the_separation_at_40_degrees_is_2_1_mm_low():
    parting = END.speed_m_s - GRAVITY * END.time_s
    assert parting == pytest.approx(2.0212, abs=1e-4)
    bias = filmed(PAPERS).separation_m - END.separation_m
    assert bias == pytest.approx(-2.1e-3, abs=0.01e-3)
    # The last leg takes 7 ms and so holds the last frame: the tops part evenly in it.
    assert PAPERS.end_s - PAPERS.hits[-2].time_s > FRAME
    assert bias == pytest.approx(-parting * FRAME / 2, rel=1e-12)


def test_one_reading_is_up_to_4_2_mm_low():
    struck, free = tops(PAPERS)
    low = []
    for phase in np.linspace(0.0, 1.0, 101):
        times = frame_times(PAPERS.end_s, float(phase))
        reading = read_frames(times, [struck(t) for t in times], free(times[0]))
        low.append(END.separation_m - reading.separation_m)
    assert low[0] == pytest.approx(0.0, abs=1e-15)
    assert max(low) == low[-1] == pytest.approx(4.2e-3, abs=0.02e-3)
    assert low == sorted(low)
    # Evenly spread over 4.2 mm: the bar of ± half a standard deviation.
    assert filmed(PAPERS).separation_bar == pytest.approx(4.2e-3 / math.sqrt(12) / 2, rel=0.02)


def test_the_speed_at_40_degrees_is_low_as_the_line_reaches_into_the_leg_before():
    """An integral over phases, in closed form leg by leg.

    The slope of a line through frames at −1.5, −0.5, 0.5 and 1.5 frames from their middle is a
    weighted mean of the three mean speeds between them: 0.3, 0.4 and 0.3.
    """
    struck, _ = tops(PAPERS)
    total = 0.0
    phases = [(k + 0.5) / 48 for k in range(48)]
    for phase in phases:
        heights = [struck(t) for t in frame_times(PAPERS.end_s, phase)]
        steps = [(b - a) / FRAME for a, b in pairwise(heights)]
        total += 0.3 * steps[0] + 0.4 * steps[1] + 0.3 * steps[2]
    seen = filmed(PAPERS)
    assert seen.speed_m_s == pytest.approx(total / 48, rel=1e-12)
    assert END.speed_m_s - seen.speed_m_s == pytest.approx(0.0657, abs=1e-4)
    # Gravity alone, over two frames, makes it 0.041 m/s low; what is more is the leg before.
    assert END.speed_m_s - seen.speed_m_s > GRAVITY * 2 * FRAME
    assert (
        END.speed_m_s - seen.speed_m_s < PAPERS.hits[-1].speed_before - PAPERS.hits[-3].speed_after
    )


@pytest.mark.parametrize("incline", [60.0, 80.0])
def test_weak_pulls_leave_gravity_alone(incline):
    """Here the last leg is longer than four frames."""
    motion = motion_at(incline)
    assert motion.end_s - motion.hits[-2].time_s > 4 * FRAME
    end = motion.at(motion.end_s)
    assert end.speed_m_s - filmed(motion).speed_m_s == pytest.approx(GRAVITY * 2 * FRAME, rel=1e-11)


def test_half_a_millimetre_of_noise_is_a_tenth_of_a_metre_per_second():
    times = frame_times(0.5, 0.5)
    weights = [
        read_frames(times, [float(k == frame) for k in range(4)], 0.0).speed_m_s
        for frame in range(4)
    ]
    assert 0.5e-3 * math.hypot(*weights) == pytest.approx(0.11, abs=0.005)


def test_free_fall_is_read_too_slow_by_gravity_over_two_frames():
    """A line through a parabola has the slope of its middle, 1.5 frames before the last one."""
    chain = even_chain(2)
    motion = Motion(chain, [0.0, 0.0], DROP, GRAVITY)
    seen = filmed(motion)
    exact = free_fall_speed(chain, DROP, GRAVITY)
    assert exact == pytest.approx(5.137, abs=5e-4)
    assert seen.speed_m_s == pytest.approx(exact - GRAVITY * 2.0 * FRAME, rel=1e-12)
    assert seen.separation_m == pytest.approx(0.0, abs=1e-15)
    assert seen.separation_bar < 1e-15
    assert seen.speed_bar == pytest.approx(GRAVITY * FRAME / math.sqrt(12) / 2, rel=0.02)


def test_a_rods_radius_and_the_line_account_for_most_of_the_papers_free_fall_speed():
    """The paper says 5.08 m/s, and 1.345 m of free fall are 5.137 m/s."""
    raised = Motion(even_chain(2), [0.0, 0.0], DROP - 0.0127 / 2, GRAVITY)
    seen = filmed(raised).speed_m_s
    assert 0.8 < (5.137 - seen) / (5.137 - 5.08) < 1.0


def test_two_frames_early_cost_the_graded_run_over_a_centimetre():
    diameters = [d for d in (0.032, 0.025, 0.019, 0.013, 0.0063) for _ in range(4)]
    gap = (1.165 - sum(diameters) + (diameters[0] + diameters[-1]) / 2) / 19
    heights = [0.0]
    for lower, upper in pairwise(diameters):
        heights.append(heights[-1] + lower / 2 + gap + upper / 2)
    motion = motion_at(40.0, Chain(tuple(d * d for d in diameters), tuple(heights)))
    end = motion.at(motion.end_s)
    assert end.separation_m == pytest.approx(0.20034710240655192, rel=1e-12)
    early = motion.at(motion.end_s - 2 * FRAME)
    assert end.separation_m - early.separation_m == pytest.approx(0.013, abs=0.001)


def test_a_faster_camera_is_less_biased():
    def bias(rate):
        return END.separation_m - filmed(PAPERS, rate_hz=rate).separation_m

    assert bias(4800.0) == pytest.approx(0.1 * bias(480.0), rel=1e-9)


def test_more_phases_are_the_same_film():
    few, many = filmed(PAPERS, phases=48), filmed(PAPERS, phases=480)
    assert few.separation_m == pytest.approx(many.separation_m, rel=1e-12)
    assert few.speed_m_s == pytest.approx(many.speed_m_s, abs=2e-4)


def test_one_phase_has_no_scatter():
    with pytest.raises(StatisticsError):
        filmed(PAPERS, phases=1)
