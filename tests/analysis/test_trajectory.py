"""Trajectories against the model room, and their derivatives against 60 digits."""

import numpy as np
import pytest
from mpmath import mp, mpf

from rig.analysis.trajectory import Trajectory, struck_trajectory
from rig.model.chain import Chain
from rig.model.fall import kicks
from tests.model.reference import exact_hits, exact_way

MASSES = (3.0, 1.0, 2.0, 0.4, 1.5)
PLACES = (0.0004, 0.0493, 0.0967, 0.1461, 0.1939)  # above the reference point; rod 0 is off it
GAINS = (0.15, -0.05, 0.3, 0.0, 0.2)
GAMMA = 4 / 3
RODS = len(MASSES)
RATIOS = tuple(kicks(Chain(MASSES, PLACES), [1.0] * RODS, GAMMA))
# Release, start, gravity, κ, gains, places: the order of a struck trajectory's parameters.
PARAMETERS = (0.0213, 0.18, 9.81, 0.0, *GAINS, *PLACES)
STEP = mpf(10) ** -20
# None, some, what an adjustment may try, very much, and so little that formulas could cancel.
KAPPAS = (0.0, 0.03, -0.02, 1.5, 2e-5)


def in_air(kappa: float) -> tuple[float, ...]:
    return (*PARAMETERS[:3], kappa, *PARAMETERS[4:])


def struck(parameters=PARAMETERS) -> Trajectory:
    release, start, gravity, kappa, *rest = parameters
    gains, places = np.array(rest[:RODS]), np.array(rest[RODS:])
    return struck_trajectory(release, start, gravity, gains, np.array(RATIOS), places, kappa)


class Exact:
    """The same fall leg by leg from the equations of v' = g − κv², in 60 digits."""

    def __init__(self, parameters) -> None:
        release, start, self.g, self.kappa, *rest = map(mpf, parameters)
        gains = [gain * ratio for gain, ratio in zip(rest[:RODS], RATIOS, strict=True)]
        places, kappas = rest[RODS:], [self.kappa] * RODS
        hits = exact_hits(places, gains, kappas, start, self.g, mpf(0))
        self.time = [release, *(release + time for time, _, _ in hits)]
        self.height = [start, *(-place for place in places)]
        self.speed = [mpf(0), *(after for _, _, after in hits)]
        self.arrival = hits[-1][1]

    def at(self, when) -> mpf:
        leg = max([k for k, begin in enumerate(self.time) if begin <= when], default=0)
        since = max(when - self.time[leg], mpf(0))
        return self.height[leg] - exact_way(since, self.speed[leg], self.g, self.kappa)


def derivatives(what, parameters) -> np.ndarray:
    """Central differences of ``what(Exact)``, one column a parameter."""
    columns = []
    with mp.workdps(60):
        for n in range(len(parameters)):
            up, down = list(map(mpf, parameters)), list(map(mpf, parameters))
            up[n] += STEP
            down[n] -= STEP
            high, low = what(Exact(up)), what(Exact(down))
            columns.append([float((a - b) / (2 * STEP)) for a, b in zip(high, low, strict=True)])
    return np.array(columns).T


def close(found, expected) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("kappa", KAPPAS)
def test_legs_and_their_derivatives_are_those_of_60_digits(kappa):
    there = in_air(kappa)
    path = struck(there)
    with mp.workdps(60):
        exact = Exact(there)
    for name in ("time", "height", "speed"):
        close(getattr(path, name), [float(value) for value in getattr(exact, name)])
        wanted = derivatives(lambda exact, name=name: getattr(exact, name), there)
        near(getattr(path.slopes, name), wanted, kappa)
    assert path.arrival == pytest.approx(float(exact.arrival), rel=1e-14)
    near(path.slopes.arrival, derivatives(lambda exact: [exact.arrival], there)[0], kappa)


@pytest.mark.parametrize("kappa", KAPPAS)
def test_heights_at_fixed_times_and_their_derivatives_are_those_of_60_digits(kappa):
    there = in_air(kappa)
    path = struck(there)
    times = moments(path)
    expected = derivatives(lambda e: [e.at(mpf(t)) for t in times], there)
    near(path.sights(times)[2], expected, kappa)
    heights, speeds = path.heights(times)
    with mp.workdps(60):
        exact = Exact(there)
        close(heights, [float(exact.at(mpf(t))) for t in times])
        slopes = [-(exact.at(mpf(t) + STEP) - exact.at(mpf(t) - STEP)) / (2 * STEP) for t in times]
    close(speeds, [float(slope) for slope in slopes])


def near(found, expected, kappa) -> None:
    """The derivative by κ is a difference over κ: of 1e-16 m or s, which its rounding is."""
    np.testing.assert_allclose(
        found, expected, rtol=1e-12, atol=1e-13 + (3e-16 / abs(kappa) if kappa else 0.0)
    )


def moments(path: Trajectory) -> np.ndarray:
    """Before the release, three in every leg, and after the last impact."""
    ends = np.append(path.time, path.time[-1] + 0.02)
    inside = ends[:-1, None] + np.diff(ends)[:, None] * np.array([0.1, 0.5, 0.9])
    return np.concatenate([[path.time[0] - 0.01], inside.ravel()])
