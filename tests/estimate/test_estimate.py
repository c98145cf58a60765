"""Coefficients of the impacts against the truth that the simulation hides."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.result import GOOD
from rig.errors import InputError
from rig.estimate.coefficients import best, coefficient_problem
from rig.estimate.hypotheses import one_alpha
from rig.estimate.hypothesis_fit import fit
from rig.estimate.posterior import Posterior, posterior
from rig.estimate.quadratic_forms import merge_like
from rig.estimate.rods import _gains
from rig.estimate.session import estimate
from rig.model.impact import alpha_inclined
from rig.protocol.plan import runs
from rig.protocol.protocol import Priors
from rig.protocol.reader import parse
from rig.report.estimate import estimate_text
from rig.sections import Sections
from rig.units import Quantity
from tests.analysis.drops import FENCE, SINGLE, UNIFORM, case
from tests.analysis.sessions import MILD, cases
from tests.analysis.sessions import analysis as analyzed
from tests.estimate.sessions import BETA, MU, analysis, forms

SURFACE = (30.0, 50.0, 70.0)
LIKE = Priors(impulses=0.05, last_impulse=0.01, strings=0.0, stretch=0.005)
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


def test_one_incline_does_not_tell_friction_from_restitution():
    found = estimate(UNIFORM, analysis((50.0,), 4)).json()
    friction, restitution = parameter(found, "friction"), parameter(found, "restitution")
    assert not friction["identified"]
    assert friction["least_squares"]["u"] == pytest.approx(0.02, rel=1e-2)
    assert any("friction is not identified" in said for said in found["left_out"])
    # What β says then is only as good as the μ that is held: at 0.20 instead of 0.26.
    assert restitution["least_squares"]["u"] > 0.02
    assert "model" not in found["tests"]


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


def test_curves_end_at_the_results():
    found = analysis(SURFACE)
    drawn = estimate(UNIFORM, found).json()["curves"]
    results = {one.run.number: one for one in found.runs if one.verdict in GOOD}
    assert [one["incline_deg"] for one in drawn] == list(SURFACE)
    for curve in drawn:
        quantities = results[curve["run"]].quantities
        separation, speed = quantities["separation_m"], quantities["speed_m_s"]
        assert curve["separation_m"][-1] == pytest.approx(separation.value, abs=1e-6)
        # The curve is at a fixed time, the result at that of the hit, which is uncertain too.
        assert curve["separation_m_U95"][-1] == pytest.approx(1.96 * separation.u, rel=0.3)
        assert curve["speed2_m2_s2"][-1] == pytest.approx(speed.value**2, rel=1e-5)
        assert curve["speed2_m2_s2_U95"][-1] == pytest.approx(
            1.96 * 2 * speed.value * speed.u, rel=0.02
        )
        assert curve["separation_m"][0] == pytest.approx(0.0, abs=2e-3)
        assert curve["speed2_m2_s2"][0] == pytest.approx(0.0, abs=1e-3)


def test_one_chain_and_few_drops_are_estimated_too():
    found = estimate(SINGLE, analyzed(cases((1, 2), scene="single"))).json()
    assert found["drops"] == 2
    assert abs(found["drag_per_m"]["value"]) < 4 * found["drag_per_m"]["u"]
    assert "separation_m" not in found["curves"][0]
    (line,) = found["alpha"]["inclines"]
    truth = alpha_inclined(0.5, 0.2, 40.0)
    assert abs(line["alpha"]["value"] - truth) < 4 * line["alpha"]["u"]


def test_where_nothing_strikes_there_is_nothing_to_estimate():
    with pytest.raises(InputError, match="no coefficients"):
        estimate(FENCE, analyzed(cases((1, 2), scene="fence")))


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
    with pytest.raises(InputError, match="no motion fits the edges of any good drop"):
        estimate(UNIFORM, replace(drops, adjusted={}))


def dropped(protocol, inclines, each):
    """Drops of a scene of its own, analysed: so many at each incline, with A, B, B, A."""
    at = {
        incline: [run for run in runs(protocol) if run.incline_deg == incline]
        for incline in inclines
    }
    numbers = [run.number for planned in at.values() for run in planned[:each]]
    return analyzed([case(protocol, MILD, run=number) for number in numbers])


def test_air_that_the_protocol_states_counts_once():
    """For the coefficients, every α and every impulse."""
    protocol = parse(f"{UNIFORM.text}drag: {{terminal_speed: 15 m/s ± 1 m/s}}\n")
    found = estimate(protocol, dropped(protocol, SURFACE, 1)).json()
    for name, truth in (("restitution", 0.5), ("friction", 0.2)):
        measured = parameter(found, name)["least_squares"]
        assert abs(measured["value"] - truth) < 4 * measured["u"]
    lines = [line for name in ("alpha", "impulses") for line in found[name]["inclines"]]
    for line, incline in zip(lines, 2 * SURFACE, strict=True):
        truth = alpha_inclined(0.5, 0.2, incline)
        assert abs(line["alpha"]["value"] - truth) < 4 * line["alpha"]["u"]


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


def test_chains_with_an_alpha_of_their_own_are_told_apart():
    """A by the surface and B given, exactly; then both given, and neither is the mean of both."""
    a, b = UNIFORM.chains["A"], UNIFORM.chains["B"]
    given = replace(b, chain=replace(b.chain, alpha=Quantity(0.25)))
    one = replace(UNIFORM, chains={"A": a, "B": given})
    found = estimate(one, dropped(one, SURFACE, 2)).json()
    assert "failed" not in found
    assert {line["name"] for line in found["parameters"]} == {"alpha", "restitution", "friction"}
    alpha = parameter(found, "alpha")["least_squares"]
    assert abs(alpha["value"] - 0.25) < 4 * alpha["u"]
    for name in ("alpha", "impulses"):
        struck = [(line["incline_deg"], line["impact_chain"]) for line in found[name]["inclines"]]
        assert struck == [(incline, chain) for incline in SURFACE for chain in "AB"]
    other = replace(a, chain=replace(a.chain, alpha=Quantity(0.15, 0.02)))
    given = replace(b, chain=replace(b.chain, alpha=Quantity(0.25, 0.02)))
    two = replace(UNIFORM, chains={"A": other, "B": given}, priors=LIKE)
    both = estimate(two, dropped(two, (50.0,), 4))
    for name, truth in (("alpha A", 0.15), ("alpha B", 0.25)):
        measured = parameter(both.json(), name)["least_squares"]
        assert abs(measured["value"] - truth) < 4 * measured["u"] < 0.02
    assert "α of A" in estimate_text(both, Sections(), simulated=True)


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
