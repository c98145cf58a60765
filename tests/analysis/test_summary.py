"""Means over runs and their differences, by hand, by Student's test and by the GUM's example."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.averages import combine, mean
from rig.analysis.distributions import coverage_factor
from rig.analysis.result import DropResult, Measured
from rig.analysis.summary import summarize
from rig.units import Quantity
from tests.analysis.drops import UNIFORM, made_up


def measured(value: float, own: float, common: float = 0.0) -> Measured:
    """A run's value with what is its own and what is common to all runs."""
    return Measured(value, math.hypot(own, common), 500.0, {"edges": own, "beam heights": common})


def test_runs_that_scatter_tell_their_own_uncertainty():
    """1, 2, 6 scatter by √7; what is common, 0.4, stays."""
    found = mean([measured(x, own=0.5, common=0.4) for x in (1.0, 2.0, 6.0)])
    runs_part = math.sqrt(7 / 3)
    assert found.value == 3.0
    assert found.u == pytest.approx(math.sqrt(7 / 3 + 0.16), rel=1e-14)
    assert found.budget == pytest.approx({"runs": runs_part, "common": 0.4}, rel=1e-14)
    # Welch–Satterthwaite (GUM G.4) with ν = 2, and the runs' own 500 of what is common.
    share = runs_part**4 / 2 + 0.4**4 / 500
    assert found.degrees == pytest.approx(found.u**4 / share, rel=1e-13)
    assert found.expanded == coverage_factor(found.degrees) * found.u


def test_runs_that_happen_to_agree_are_no_better_than_each_allows():
    found = mean([measured(x, own=3.0, common=4.0) for x in (10.0, 10.0, 10.3, 9.7)])
    assert found.value == pytest.approx(10.0)
    assert found.u == pytest.approx(math.hypot(3 / 2, 4), rel=1e-14)
    # Nor are ten fences surer of how sure they are than one.
    parts = (3 / 2) ** 4 / 500 + 4.0**4 / 500
    assert found.degrees == pytest.approx(found.u**4 / parts, rel=1e-13)
    few = mean([replace(measured(10.0, own=3.0), degrees=2.0)] * 10)
    assert found.expanded == coverage_factor(found.degrees) * found.u
    assert few.expanded == pytest.approx(4.302652729911275 * 3.0 / math.sqrt(10), rel=1e-9)


def results(protocol, values: dict[float, list[float]], verdict="accepted") -> list[DropResult]:
    """Made-up drops: Δz is the value, V fifty times it."""
    found = []
    for incline, numbers in values.items():
        planned = [run for run in protocol.runs() if run.incline_deg == incline]
        for run, x in zip(planned, numbers, strict=False):
            both = {"separation_m": measured(x, 1e-4), "speed_m_s": measured(50 * x, 1e-2)}
            found.append(made_up(run, verdict, **both))
    return found


def test_outside_the_model_there_is_nothing_to_compare_with():
    """Eq. 13 is singular for slender rods on a steep enough friction."""
    chain = replace(UNIFORM.chains["A"].chain, inertia=0.01)
    rods = replace(UNIFORM.chains["A"], chain=chain)
    surface = replace(UNIFORM.surface, friction=Quantity(1.2), pile=None)
    protocol = replace(UNIFORM, chains={"A": rods, "B": rods}, surface=surface)
    (line,) = summarize(protocol, results(protocol, {40.0: [0.1, 0.11]}))
    assert line.predicted == {}
    assert line.json()["normalized_error"] is None


def difference(some, reference):
    return combine([some, reference], (1.0, -1.0))


def alike(values, u, shared=None):
    return [Measured(float(value), u, shared=shared) for value in values]


def test_of_runs_that_scatter_it_is_students_interval():
    rng = np.random.default_rng(1)
    one, other = rng.normal(3.0, 1.0, 5), rng.normal(2.0, 1.0, 8)
    found = difference(alike(one, 1e-6), alike(other, 1e-6))
    from scipy.stats import ttest_ind  # takes a second, which collecting need not

    interval = ttest_ind(one, other).confidence_interval(0.95)
    low, high = found.value - found.expanded, found.value + found.expanded
    assert (low, high) == pytest.approx((interval.low, interval.high), rel=1e-6)


def test_what_both_share_cancels_and_what_only_one_has_stays():
    vector, other = np.array([3.0, 0.0]), np.array([3.0, 4.0])
    same = difference(alike([1.0] * 4, 5.0, vector), alike([2.0] * 4, 5.0, vector))
    assert same.budget["common"] == 0.0
    unlike = difference(alike([1.0] * 4, 6.0, vector), alike([2.0] * 4, 6.0, other))
    assert unlike.budget["common"] == pytest.approx(4.0)
    assert unlike.u**2 == pytest.approx((36 - 9 + 36 - 25) / 4 + 16)


def test_where_one_run_was_not_fitted_jointly_only_budget_lines_count_and_the_fewest_degrees():
    joint = Measured(1.0, 5.0, 9.0, {"datum": 3.0, "edges": 4.0}, shared=np.array([5.0]))
    found = combine([[joint, replace(joint, degrees=4.0, shared=None)]], [1.0])
    assert found.budget == pytest.approx({"runs": 4.0 / math.sqrt(2.0), "common": 3.0})
    share = sum(part**4 for part in found.budget.values())
    assert found.degrees == pytest.approx(4.0 * found.u**4 / share)
