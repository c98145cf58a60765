"""Whole nine-incline sessions: how good β and μ are, and whether their intervals hold."""

import numpy as np
import pytest

from rig.estimate.coefficients import best, coefficient_problem
from rig.estimate.quadratic_forms import merge_like
from tests.analysis.drops import UNIFORM
from tests.estimate.sessions import BETA, MU, forms

SEEDS = range(1, 9)


@pytest.mark.slow
def test_restitution_and_friction_from_one_nine_incline_session():
    """β to ± 0.01 and μ to ± 0.02 (95 %), as promised; two truths, eight rigs."""
    inclines = UNIFORM.plan.inclines
    ratios = []
    for seed in SEEDS:
        every = merge_like(forms(inclines, UNIFORM.plan.repeats, seed))
        outcome = best(UNIFORM, coefficient_problem(UNIFORM, every))
        for name, truth, wanted in (("restitution", BETA, 0.01), ("friction", MU, 0.02)):
            value, u = outcome[name].value, outcome[name].u
            assert abs(value - truth) < wanted
            assert 1.96 * u < wanted
            ratios.append((value - truth) / u)
    # χ² of 16 (in pairs correlated): a factor of two either way would be seen.
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.6
