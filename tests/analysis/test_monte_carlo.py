"""JCGM 101 beside the GUM budget: the same inputs, nothing linearised."""

import json
import math
from itertools import count

import numpy as np
import pytest

from rig.analysis.budgets import Budgets
from rig.analysis.monte_carlo import (
    BLOCK,
    Propagated,
    agreement,
    monte_carlo,
    session_monte_carlo,
    tolerance,
    until_stable,
)
from rig.commands.budget import session_trials
from rig.errors import InputError
from rig.report import templates
from tests.analysis.sessions import MILD, analysis, cases, fit_session, fits

TRIALS = 150
FOUR = (1, 2, 3, 4)


@pytest.mark.parametrize("scene", ["uniform", "fence"])
def test_both_ways_agree(scene):
    """χ² of 149, once in 10⁴ each side: u within factors 0.78 and 1.23; the mean within 4 SE."""
    (fit,) = fits(cases((1,), seed=6, scene=scene))
    (one,) = cases((1,), seed=6, scene=scene)
    found = monte_carlo(fit, TRIALS, seed=1)
    quantities = one.analyze().quantities
    assert found.keys() == quantities.keys()
    for name, measured in quantities.items():
        propagated = found[name]
        assert 0.78 < propagated.u / measured.u < 1.23, name
        assert abs(propagated.mean - measured.value) < 4 * measured.u / math.sqrt(TRIALS), name
        assert propagated.low < measured.value < propagated.high


def test_a_seed_is_kept():
    (fit,) = fits(cases((1,), seed=6, scene="fence"))
    one, same, other = (monte_carlo(fit, 5, seed) for seed in (3, 3, 4))
    assert one == same != other


SESSION_TRIALS = 60


def test_a_session_s_trials_scatter_as_its_budgets_say():
    """u of 60 trials is known to 9 %: within 36 %, and the means within four standard errors."""
    joint = fit_session(FOUR, MILD, 1)
    budgets = Budgets(joint)
    drawn = session_monte_carlo(joint, SESSION_TRIALS, seed=2)
    assert len(drawn) == len(joint.drops)
    for drop, found in zip(joint.drops, drawn, strict=True):
        measured = budgets.measured(drop)
        assert found.keys() == measured.keys()
        for name, one in measured.items():
            assert 0.64 < found[name].u / one.u < 1.36, name
            off = abs(found[name].mean - one.value)
            assert off < 4 * one.u / math.sqrt(SESSION_TRIALS), name


def test_a_session_s_seed_is_kept():
    joint = fit_session(FOUR, MILD, 1)
    one, same, other = (session_monte_carlo(joint, 2, seed) for seed in (3, 3, 4))
    assert one == same != other


@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_intervals_agree_as_their_ends_do(shift):
    """Half a unit of the first digit of u is 12.5 % of u here; 10⁶ trials are good for 0.5 %."""
    drawn = Propagated(5.0, 0.004, 5.0 - 1.959964 * 0.004, 5.0 + 1.959964 * 0.004)
    found = agreement(5.0 + shift * 0.004, 0.004, drawn, 10**6)
    assert found.d_low == pytest.approx(shift * 0.004, abs=1e-8)
    assert found.d_high == pytest.approx(shift * 0.004, abs=1e-8)
    assert found.tolerance == pytest.approx(0.0005)
    assert found.error == pytest.approx(0.0054 * 0.004, rel=0.01)
    assert found.decided
    assert found.agrees == (shift == 0.0)
    assert not agreement(5.0 + shift * 0.004, 0.004, drawn, 100).decided
    assert found.json()["agrees"] == found.agrees


def test_trials_of_a_session_are_said_run_by_run():
    drops = cases(FOUR, MILD, 1)
    found = json.loads(json.dumps(session_trials(analysis(drops), 3), allow_nan=False))
    assert (found["trials"], found["seed"]) == (3, 1)
    assert [run["run"] for run in found["runs"]] == list(FOUR)
    for run in found["runs"]:
        for one in run["quantities"].values():
            assert one["low"] < one["mean"] < one["high"]
            assert type(one["agrees"]) is bool
            assert one["u_ratio"] > 0.0
    head, _, *lines = templates.lines("trials", found)
    assert "3 trials, seed 1" in head
    assert len(lines) == len(found["runs"][0]["quantities"])
    assert all("of 4 agree" in line for line in lines)


def test_too_little_for_trials_is_bad_input():
    drops = cases(FOUR, MILD, 1)
    with pytest.raises(InputError, match="too few good runs"):
        session_trials(analysis(drops[:3]), 10)
    with pytest.raises(InputError, match="1 trials tell no uncertainty"):
        session_trials(analysis(drops), 1)


M = 10**6


def _sum(kind, rng):
    """JCGM 101, 9.2: four normal inputs, four rectangular, and one of these ten times wider."""
    if kind == "normal":
        return rng.normal(size=(4, M)).sum(axis=0)
    half = math.sqrt(3.0) * np.array([1.0, 1.0, 1.0, 10.0 if kind == "one is wider" else 1.0])
    return (half[:, None] * rng.uniform(-1.0, 1.0, (4, M))).sum(axis=0)


@pytest.mark.parametrize(
    ("kind", "u", "end", "validated"),
    # Tables 2 to 4: u and the end of the symmetric 95 % interval, to the digits given there.
    [
        ("normal", 2.0, 3.92, True),
        ("rectangular", 2.0, 3.88, True),
        ("one is wider", 10.1, 17.0, False),
    ],
)
def test_sums_of_jcgm_101(kind, u, end, validated):
    drawn = Propagated.of(_sum(kind, np.random.default_rng(5)))
    last = 0.1 if kind == "one is wider" else 0.01
    assert drawn.u == pytest.approx(u, abs=0.05)
    assert (-drawn.low, drawn.high) == pytest.approx((end, end), abs=0.5 * last + 2 * 2.7e-3 * u)
    found = agreement(0.0, u if kind != "one is wider" else math.sqrt(103.0), drawn, M, digits=2)
    # 3.92 and 3.88 are so near to δ = 0.05 apart that this many trials do not tell.
    assert found.decided == (kind != "rectangular")
    assert found.agrees == validated


def curved(rng, half, half_u, size):
    """A rectangle whose half width is known to ± `half_u`: JCGM 101, 6.4.3."""
    return rng.uniform(half - half_u, half + half_u, size) * rng.uniform(-1.0, 1.0, size)


def gauge_block(rng, size):
    """9.5, table 10, in nm: deviation of a block's length from 50 mm, by a comparator."""
    standard = 50_000_623.0 + 25.0 * rng.standard_t(18, size)
    difference = 215.0 + 6.0 * rng.standard_t(24, size)
    difference += 4.0 * rng.standard_t(5, size) + 7.0 * rng.standard_t(8, size)
    expansion = rng.uniform(9.5e-6, 13.5e-6, size)
    warmer = rng.normal(-0.1, 0.2, size) + 0.5 * np.sin(2.0 * np.pi * rng.uniform(size=size))
    apart = curved(rng, 1.0e-6, 0.1e-6, size), curved(rng, 0.050, 0.025, size)
    own = standard * (apart[0] * warmer + expansion * apart[1])
    return standard + difference - own - 50_000_000.0


def test_gauge_block_of_jcgm_101():
    """Table 11: 838 nm, u = 36 nm, 99 % in 745 to 932 nm, where the GUM's own u is 32 nm."""
    rng = np.random.default_rng(8)
    seen = []

    def draw():
        while True:
            seen.append(gauge_block(rng, 10 * BLOCK))
            yield from ({"length": value} for value in seen[-1].tolist())

    found, trials = until_stable(draw(), 10 * BLOCK, digits=2)
    assert trials == 10 * BLOCK * len(seen)
    length = found["length"]
    assert length.mean == pytest.approx(838.0, abs=0.5 + tolerance(36.0, 2))
    assert length.u == pytest.approx(36.0, abs=0.5 + tolerance(36.0, 2))
    ordered = np.sort(np.concatenate(seen))
    held = round(0.99 * ordered.size)
    begin = int(np.argmin(ordered[held:] - ordered[: ordered.size - held]))
    assert (ordered[begin], ordered[begin + held]) == pytest.approx((745.0, 932.0), abs=2.0)
    assert not agreement(838.0, 32.0, length, trials, digits=2).agrees


@pytest.mark.parametrize(("digits", "least", "most"), [(1, 2, 40), (2, 41, 2000)])
def test_trials_go_on_until_the_digits_that_count_stand(digits, least, most):
    """Each digit more takes a hundred times as many."""
    rng = np.random.default_rng(9)
    found, trials = until_stable(({"y": rng.normal()} for _ in count()), 100, digits)
    assert least <= trials / 100 <= most
    assert found["y"].high == pytest.approx(1.96, abs=2.0 * tolerance(1.0, digits))
