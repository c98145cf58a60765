"""Coefficients of the impacts against the truth that the simulation hides."""

from dataclasses import replace

import numpy as np
import pytest

from rig.errors import InputError
from rig.estimate.coefficients import best, coefficient_problem
from rig.estimate.hypotheses import one_alpha
from rig.estimate.hypothesis_fit import fit
from rig.estimate.posterior import Posterior, posterior
from rig.estimate.quadratic_forms import merge_like
from rig.estimate.rods import _gains
from rig.estimate.session import estimate
from rig.units import Quantity
from tests.analysis.drops import FENCE, UNIFORM, case
from tests.analysis.sessions import MILD, cases
from tests.analysis.sessions import analysis as analyzed
from tests.estimate.sessions import BETA, MU, analysis, forms
from tests.refusals import refused

SURFACE = (30.0, 50.0, 70.0)
"""What is known of impulses that are nearly alike, and of strings that hardly stretch: else a few
drops tell no α to a part in ten."""


@pytest.fixture(scope="module")
def found():
    return estimate(UNIFORM, analysis(SURFACE)).json()


def parameter(found, name):
    return next(one for one in found["parameters"] if one["name"] == name)


@pytest.mark.parametrize(("name", "truth"), [("restitution", BETA), ("friction", MU)])
def test_the_coefficients_are_found_whatever_the_protocol_says(found, name, truth):
    """The protocol's 0.50 and 0.20 are many standard uncertainties away."""
    one = parameter(found, name)
    measured = one["least_squares"]
    assert one["identified"]
    assert one["posterior"]["u"] < measured["u"] < one["stated"]["u"]
    assert abs(measured["value"] - truth) < 4 * measured["u"]
    assert measured["u"] < 0.02
    assert abs(measured["value"] - one["stated"]["value"]) > 4 * measured["u"]


def test_the_end_correction_is_needed_and_is_that_of_eq_10(found):
    end = found["end_correction"]
    assert end["needed"]
    assert end["delta_aic"]["without"] > 100  # ten times what is called decisive
    assert abs(end["scale"]["value"] - 1) < 4 * end["scale"]["u"]


def test_impulses_of_all_rods_are_within_their_uncertainty(found):
    errors = [
        group["normalized_error"]
        for line in found["impulses"]["inclines"]
        for group in line["groups"]
    ]
    assert np.mean(np.abs(errors) < 1.0) > 0.85
    for line in found["impulses"]["inclines"]:
        assert [
            rod for group in line["groups"] for rod in range(group["rods"][0], group["rods"][1] + 1)
        ] == list(range(24))


def test_a_pile_tells_only_its_own_restitution():
    """The dial of the simulation sets the pile's β too."""
    found = estimate(UNIFORM, analysis((10.0,), 2)).json()
    assert [one["name"] for one in found["parameters"]] == ["pile_restitution"]
    measured = parameter(found, "pile_restitution")["least_squares"]
    assert abs(measured["value"] - BETA) < 4 * measured["u"]


def test_alpha_of_each_run_is_that_of_the_joint_adjustment():
    """Two ways to the same number: the forms, and the adjustment they were made from."""
    found = analysis(SURFACE)
    each = fit(forms(SURFACE), one_alpha(forms(SURFACE), lambda one: one.run.number))
    for (run, _), drop in found.adjusted.items():
        at = drop.model.unknowns["alpha"]
        alpha = each[f"α {run}"]
        joint = drop.x[at][0]
        assert abs(joint - alpha.value) < 0.1 * alpha.u


def test_without_priors_the_posterior_is_the_least_squares_fit():
    """But for the curvature of α in μ, which is small over so narrow a range."""
    surface = UNIFORM.surface
    vague = replace(
        UNIFORM, surface=replace(surface, restitution=Quantity(0.5), friction=Quantity(0.2))
    )
    found = coefficient_problem(vague, merge_like(forms(SURFACE)))
    centre = best(vague, found)
    spread = posterior(vague, found, centre)
    for name in ("restitution", "friction"):
        told, fitted = spread.summary(name), centre[name]
        assert abs(told["value"] - fitted.value) < 0.1 * fitted.u
        assert told["u"] == pytest.approx(fitted.u, rel=0.05)
        assert told["low"] < told["value"] < told["high"]
        assert told["high"] - told["low"] == pytest.approx(2 * 1.96 * told["u"], rel=0.03)


def test_where_nothing_strikes_there_is_nothing_to_estimate():
    drops = analyzed(cases((1, 2), scene="fence"))
    refused(InputError, "no coefficients", estimate, FENCE, drops)


def test_good_drops_that_no_motion_fits_are_left_out_and_named():
    """They count, with the ± that they have, and tell no coefficient."""
    drops = analysis(SURFACE)
    (out, _), *_ = drops.adjusted
    fewer = {key: drop for key, drop in drops.adjusted.items() if key[0] != out}
    found = estimate(UNIFORM, replace(drops, adjusted=fewer))
    assert found.drops == len(drops.runs) - 1
    assert [one for one in found.left_out if one.startswith("run ")] == [
        f"run {out} is left out: no motion fits its edges, or not together with the other runs; "
        "rig analyze SESSION says which"
    ]
    none = replace(drops, adjusted={})
    refused(InputError, "no motion fits the edges of any good drop", estimate, UNIFORM, none)


def dropped(protocol, inclines, each):
    """Drops of a scene of its own, analysed: so many at each incline, with A, B, B, A."""
    at = {
        incline: [run for run in protocol.runs() if run.incline_deg == incline]
        for incline in inclines
    }
    numbers = [run.number for planned in at.values() for run in planned[:each]]
    return analyzed([case(protocol, MILD, run=number) for number in numbers])


def test_inclines_outside_the_model_tell_no_coefficient():
    """At 10° a rod with μ 0.2 does not slide."""
    protocol = replace(UNIFORM, surface=replace(UNIFORM.surface, pile=None))
    found = estimate(protocol, dropped(protocol, (0.0, 10.0, 50.0), 1)).json()
    assert any(said.startswith("10° tells no coefficient") for said in found["left_out"])
    assert len(found["alpha"]["inclines"]) == 3
    # With level ground, which has no friction, one incline is enough.
    assert parameter(found, "friction")["identified"]
    assert parameter(found, "restitution")["identified"]


def test_what_is_exact_and_not_told_leaves_the_fit():
    """One incline leaves μ open, and the protocol gives it no ±: it is no parameter at all."""
    exact = replace(UNIFORM, surface=replace(UNIFORM.surface, friction=Quantity(0.2)))
    found = estimate(exact, analysis((50.0,), 4)).json()
    assert [one["name"] for one in found["parameters"]] == ["restitution"]
    assert any("friction is not identified" in said for said in found["left_out"])
    measured = parameter(found, "restitution")
    # Nothing else pulls at β, so that its posterior is the edges' and its prior's alone.
    edges, prior = measured["least_squares"], measured["stated"]
    both = (edges["u"] ** -2 + prior["u"] ** -2) ** -0.5
    assert measured["posterior"]["u"] == pytest.approx(both, rel=1e-3)
    # Exactly the same β comes out of a fit in which μ is held as hard as numbers allow.
    held = replace(UNIFORM, surface=replace(UNIFORM.surface, friction=Quantity(0.2, 1e-7)))
    other = parameter(estimate(held, analysis((50.0,), 4)).json(), "restitution")["least_squares"]
    assert edges["value"] == pytest.approx(other["value"], rel=1e-6)
    assert edges["u"] == pytest.approx(other["u"], rel=1e-4)


def test_a_quantile_of_a_distribution_narrower_than_floats_ends():
    narrow = Posterior(("x",), np.ones(1), np.array([[0.5]]), np.array([[1e-17]]))
    assert narrow.summary("x")["high"] == pytest.approx(0.5, abs=1e-15)


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
