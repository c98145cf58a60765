"""Trajectories against the model room, and their derivatives against 60 digits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from rig.analysis.trajectory import Trajectory, free_trajectory, struck_trajectory
from rig.model.chain import Chain
from rig.model.fall import hits, kicks

MASSES = (3.0, 1.0, 2.0, 0.4, 1.5)
PLACES = (0.0004, 0.0493, 0.0967, 0.1461, 0.1939)  # above the reference point; rod 0 is off it
GAINS = (0.15, -0.05, 0.3, 0.0, 0.2)
GAMMA = 4 / 3
RODS = len(MASSES)
RATIOS = tuple(kicks(Chain(MASSES, PLACES), [1.0] * RODS, GAMMA))
# Release, start, gravity, gains, places: the order of a struck trajectory's parameters.
PARAMETERS = (0.0213, 0.18, 9.81, *GAINS, *PLACES)
STEP = mpf(10) ** -20


def struck(parameters=PARAMETERS) -> Trajectory:
    release, start, gravity, *rest = parameters
    gains, places = np.array(rest[:RODS]), np.array(rest[RODS:])
    return struck_trajectory(release, start, gravity, gains, np.array(RATIOS), places)


class Exact:
    """The same fall from the equations of uniform acceleration, in 60 digits."""

    def __init__(self, parameters) -> None:
        release, start, self.g, *rest = map(mpf, parameters)
        gains, places = rest[:RODS], rest[RODS:]
        self.time, self.height, self.speed = [release], [start], [mpf(0)]
        for gain, ratio, place in zip(gains, RATIOS, places, strict=True):
            fallen = self.height[-1] + place
            self.arrival = mp.sqrt(self.speed[-1] ** 2 + 2 * self.g * fallen)
            self.time.append(self.time[-1] + (self.arrival - self.speed[-1]) / self.g)
            self.height.append(-place)
            self.speed.append(self.arrival + gain * ratio * self.arrival)

    def at(self, when) -> mpf:
        leg = max([k for k, begin in enumerate(self.time) if begin <= when], default=0)
        since = max(when - self.time[leg], mpf(0))
        return self.height[leg] - self.speed[leg] * since - self.g * since**2 / 2


def derivatives(what) -> np.ndarray:
    """Central differences of ``what(Exact)``, one column a parameter."""
    columns = []
    with mp.workdps(60):
        for n in range(len(PARAMETERS)):
            up, down = list(map(mpf, PARAMETERS)), list(map(mpf, PARAMETERS))
            up[n] += STEP
            down[n] -= STEP
            high, low = what(Exact(up)), what(Exact(down))
            columns.append([float((a - b) / (2 * STEP)) for a, b in zip(high, low, strict=True)])
    return np.array(columns).T


def close(found, expected) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


def test_values_are_those_of_60_digits():
    with mp.workdps(60):
        exact = Exact(PARAMETERS)
    path = struck()
    close(path.time, [float(t) for t in exact.time])
    close(path.height, [float(z) for z in exact.height])
    close(path.speed, [float(v) for v in exact.speed])
    assert path.arrival == pytest.approx(float(exact.arrival), rel=1e-14)


def test_values_are_those_of_the_model_room():
    chain = Chain(MASSES, tuple(place - PLACES[0] for place in PLACES))
    gains = kicks(chain, GAINS, GAMMA)
    expected = hits(chain, gains, 0.18 + PLACES[0], 9.81)
    path = struck()
    close(path.time[1:] - path.time[0], [hit.time_s for hit in expected])
    close(path.speed[1:], [hit.speed_after for hit in expected])
    assert path.arrival == pytest.approx(expected[-1].speed_before, rel=1e-14)


def test_derivatives_of_times_heights_speeds_and_arrival():
    path = struck()
    close(path.d_time, derivatives(lambda exact: exact.time))
    close(path.d_height, derivatives(lambda exact: exact.height))
    close(path.d_speed, derivatives(lambda exact: exact.speed))
    close(path.d_arrival, derivatives(lambda exact: [exact.arrival])[0])


def moments(path: Trajectory) -> np.ndarray:
    """Before the release, three in every leg, and after the last impact."""
    ends = np.append(path.time, path.time[-1] + 0.02)
    inside = ends[:-1, None] + np.diff(ends)[:, None] * np.array([0.1, 0.5, 0.9])
    return np.concatenate([[path.time[0] - 0.01], inside.ravel()])


def test_derivatives_of_heights_at_fixed_times():
    path = struck()
    times = moments(path)
    close(path.derivatives(times), derivatives(lambda e: [e.at(mpf(t)) for t in times]))
    heights, speeds = path.heights(times)
    with mp.workdps(60):
        exact = Exact(PARAMETERS)
        close(heights, [float(exact.at(mpf(t))) for t in times])
        slopes = [-(exact.at(mpf(t) + STEP) - exact.at(mpf(t) - STEP)) / (2 * STEP) for t in times]
    close(speeds, [float(slope) for slope in slopes])


def test_free_fall_has_the_closed_form():
    release, start, gravity = 0.0213, 0.18, 9.81
    path = free_trajectory(release, start, gravity)
    times = np.array([0.0, 0.0213, 0.1, 0.3, 0.7])
    since = np.maximum(times - release, 0.0)
    heights, speeds = path.heights(times)
    close(heights, start - gravity * since**2 / 2)
    close(speeds, gravity * since)
    close(path.derivatives(times), np.stack([gravity * since, since**0, -(since**2) / 2], axis=1))
    close(path.d_time, [[1, 0, 0]])
    close(path.d_height, [[0, 1, 0]])
    assert not path.d_speed.any()
    assert path.arrival == 0.0
    assert not path.d_arrival.any()


def test_without_gains_a_struck_chain_falls_freely():
    struck_path = struck((*PARAMETERS[:3], *[0.0] * RODS, *PLACES))
    free = free_trajectory(*PARAMETERS[:3])
    times = moments(struck_path)
    close(struck_path.heights(times), free.heights(times))
    found = struck_path.derivatives(times)
    close(found[:, :3], free.derivatives(times))
    # Where a rod strikes does not matter to a chain that is not pulled.
    close(found[:, 3 + RODS :], np.zeros((times.size, RODS)))


paths = st.one_of(
    st.builds(free_trajectory, st.floats(-1, 1), st.floats(0.01, 2), st.floats(1, 20)),
    st.builds(
        lambda release, start, gravity, gains: struck((release, start, gravity, *gains, *PLACES)),
        st.floats(-1, 1),
        st.floats(0.01, 2),
        st.floats(1, 20),
        st.tuples(*[st.floats(-0.1, 0.5)] * RODS),
    ),
)


@given(paths, st.lists(st.floats(-1.0, 1.99), min_size=1, max_size=8))
def test_heights_and_times_are_inverse(path, fractions):
    heights = path.height[0] * (1 - np.array(fractions) ** 2)  # from the start to below contact
    found, _ = path.heights(path.times(heights))
    # A time near 1 s is rounded to 1e-16 s, in which the chain falls less than 1e-14 m.
    np.testing.assert_allclose(found, heights, atol=1e-13)


@given(paths, st.lists(st.floats(1e-3, 0.5), min_size=1, max_size=8))
def test_times_and_heights_are_inverse(path, since):
    times = path.time[0] + np.array(since)
    heights, speeds = path.heights(times)
    # The slower the chain, the less a rounded height says of the time.
    assert np.all(np.abs(path.times(heights) - times) < 1e-15 * (4 + 20 / speeds))


@given(paths, st.floats(0, 10))
def test_nothing_is_above_the_start(path, above):
    (when,) = path.times(np.array([path.height[0] + above]))
    assert when == path.time[0]
    height, speed = path.heights(np.array([path.time[0] - above]))
    assert (height[0], speed[0]) == (path.height[0], 0.0)
