"""Differences of means beside Student's test, and beside the law of errors that cancel."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.averages import combine
from rig.analysis.result import Measured


def difference(runs, reference):
    return combine([runs, reference], (1.0, -1.0))


def runs(values, u, shared=None):
    return [Measured(float(value), u, shared=shared) for value in values]


def test_of_runs_that_scatter_it_is_students_interval():
    rng = np.random.default_rng(1)
    one, other = rng.normal(3.0, 1.0, 5), rng.normal(2.0, 1.0, 8)
    found = difference(runs(one, 1e-6), runs(other, 1e-6))
    from scipy.stats import ttest_ind  # takes a second, which collecting need not

    interval = ttest_ind(one, other).confidence_interval(0.95)
    low, high = found.value - found.expanded, found.value + found.expanded
    assert (low, high) == pytest.approx((interval.low, interval.high), rel=1e-6)


def test_of_runs_that_scatter_less_than_they_are_known_it_is_their_own_uncertainty():
    found = difference(runs([1.0, 1.0, 1.0, 1.0], 0.2), runs([2.0, 2.0], 0.2))
    assert found.value == -1.0
    assert found.u == pytest.approx(0.2 * math.sqrt(1 / 4 + 1 / 2))


def test_what_both_share_cancels_and_what_only_one_has_stays():
    vector, other = np.array([3.0, 0.0]), np.array([3.0, 4.0])
    same = difference(runs([1.0] * 4, 5.0, vector), runs([2.0] * 4, 5.0, vector))
    assert same.budget["common"] == 0.0
    unlike = difference(runs([1.0] * 4, 6.0, vector), runs([2.0] * 4, 6.0, other))
    assert unlike.budget["common"] == pytest.approx(4.0)
    assert unlike.u**2 == pytest.approx((36 - 9 + 36 - 25) / 4 + 16)


def test_where_one_run_was_not_fitted_jointly_only_budget_lines_count_and_the_fewest_degrees():
    joint = Measured(1.0, 5.0, 9.0, {"datum": 3.0, "edges": 4.0}, shared=np.array([5.0]))
    found = combine([[joint, replace(joint, degrees=4.0, shared=None)]], [1.0])
    assert found.budget == pytest.approx({"runs": 4.0 / math.sqrt(2.0), "common": 3.0})
    share = sum(part**4 for part in found.budget.values())
    assert found.degrees == pytest.approx(4.0 * found.u**4 / share)
