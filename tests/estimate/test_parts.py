"""Pieces of the estimate against what can be worked out by other means."""

import numpy as np

from rig.analysis.trajectory import DRAG, free_trajectory, struck_trajectory
from rig.estimate.rods import _gains
from rig.model.chain import Chain
from rig.model.drag import drag_hits, fallen
from tests.analysis.drops import UNIFORM, impact_ratios


def test_a_little_air_by_the_exact_fall_of_a_free_chain():
    kappa, gravity = 1e-6, 9.81
    times = np.linspace(0.0, 0.6, 25)
    path = free_trajectory(0.1, 0.3, gravity)
    exact = [(0.5 * gravity * t * t - fallen(t, gravity, kappa)) / kappa for t in times]
    np.testing.assert_allclose(path.derivatives(times + 0.1)[:, DRAG], exact, rtol=1e-4, atol=1e-9)


def test_a_little_air_by_the_exact_fall_of_a_struck_chain():
    """Where each rod strikes later by dt, the chain was higher by v·dt just before."""
    chain: Chain = UNIFORM.chains["A"].chain
    ratios, gravity, kappa = impact_ratios(chain), 9.81, 1e-6
    alphas = np.full(chain.rods, 0.15)
    path = struck_trajectory(0.0, 0.18, gravity, alphas, ratios, np.array(chain.heights))
    gains = (alphas * ratios).tolist()
    plain, air = (drag_hits(chain, gains, [k] * chain.rods, 0.18, gravity) for k in (0.0, kappa))
    before = np.nextafter(path.time[1:], 0.0)
    later = np.array([b.time_s - a.time_s for a, b in zip(plain, air, strict=True)]) / kappa
    speed = np.array([hit.speed_before for hit in plain])
    np.testing.assert_allclose(path.derivatives(before)[:, DRAG], later * speed, rtol=1e-4)


def test_rods_that_are_not_resolved_are_taken_with_their_neighbours():
    sizes, sure = np.ones(5), 0.01  # beside u = 1
    middle = np.diag([sure, 1.0, 1.0, sure, sure])
    middle[1, 2] = middle[2, 1] = sure - 1.0
    for covariance, groups in (
        (middle, [(0, 0), (1, 2), (3, 3), (4, 4)]),  # known by their sum alone
        # What is left over at the end joins the last group; if nothing is known, all are one.
        (np.diag([sure] * 4 + [1.0]), [(0, 0), (1, 1), (2, 2), (3, 4)]),
        (np.eye(5), [(0, 4)]),
    ):
        gains = _gains(sizes, covariance, sizes)
        assert [(gain.first, gain.last) for gain in gains] == groups
