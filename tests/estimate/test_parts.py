"""Which rods a table of impulses takes together."""

import numpy as np

from rig.estimate.rods import _gains


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
