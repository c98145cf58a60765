"""Impacts that last, by general solvers, against the closed form."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import DomainError, RigError
from rig.model.chain import Chain
from rig.model.contact import contact_fall
from rig.model.contact_ode import (
    IMPLICIT,
    METHODS,
    Integration,
    StepBudgetError,
    integrate_contact,
)
from rig.model.fall import fall, kicks
from tests.examples import examples
from tests.model.chains import close, decades, even_chain

MODEL = Path(__file__).parents[2] / "rig" / "model"
DROP, GRAVITY = 0.18, 9.81
CHAIN = even_chain(4)
GAINS = kicks(CHAIN, [0.155] * 4, 4 / 3)
STIFF = [1e-5, 1e-9]
SOFT = [3e-2, 1e-3]


def solve(method, tau, chain=CHAIN, gains=GAINS, **how) -> Integration:
    return integrate_contact(chain, gains, DROP, GRAVITY, tau, method=method, **how)


def assert_close(found, tau, relative, chain=CHAIN, gains=GAINS):
    wanted = contact_fall(chain, gains, DROP, GRAVITY, tau)
    assert close(found.fall.separation_m, wanted.separation_m, relative)
    assert close(found.fall.speed_m_s, wanted.speed_m_s, relative)
    assert close(found.fall.time_s, wanted.time_s, relative)


def test_the_methods():
    assert METHODS == ("RK45", "DOP853", "Radau", "BDF", "LSODA")
    assert set(METHODS) - IMPLICIT == {"RK45", "DOP853"}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("tau", SOFT)
def test_every_method_where_nothing_is_stiff(method, tau):
    assert_close(solve(method, tau, rtol=1e-6, atol=1e-10), tau, 1e-7)


@pytest.mark.parametrize("method", sorted(IMPLICIT))
@pytest.mark.parametrize("tau", STIFF)
def test_implicit_methods_where_it_is(method, tau):
    found = solve(method, tau, rtol=1e-6, atol=1e-10, step_budget=3000)
    assert_close(found, tau, 1e-9)  # the pulls are over before the next rod strikes
    assert found.njev > 0


@pytest.mark.parametrize("method", METHODS)
def test_a_tighter_tolerance_comes_closer(method):
    wanted = contact_fall(CHAIN, GAINS, DROP, GRAVITY, 0.03)
    loose, tight = (solve(method, 0.03, rtol=rtol, atol=rtol * 1e-4) for rtol in (1e-3, 1e-7))
    errors = [abs(one.fall.speed_m_s - wanted.speed_m_s) for one in (loose, tight)]
    assert errors[1] < 1e-5 * wanted.speed_m_s
    assert errors[1] < 0.01 * errors[0]
    assert tight.steps > loose.steps
    assert tight.nfev > loose.nfev


@pytest.mark.parametrize("method", METHODS)
def test_counts_are_the_same_each_time(method):
    one, other = (solve(method, 1e-3, rtol=1e-4, atol=1e-8) for _ in range(2))
    assert one == other
    assert one.nfev > one.steps > CHAIN.rods
    # One Jacobian a leg, as it never changes; LSODA begins with a method that takes none.
    assert one.njev == 0 if method not in IMPLICIT else method == "LSODA" or one.njev == 4


@pytest.mark.parametrize("method", METHODS)
def test_steps_are_those_of_the_solver(monkeypatch, method):
    import rig.model.contact_ode as module

    real, runs = module.solve_ivp, []
    monkeypatch.setattr(module, "solve_ivp", lambda *a, **k: runs.append(real(*a, **k)) or runs[-1])
    found = solve(method, 1e-3, rtol=1e-4, atol=1e-8)
    assert len(runs) == CHAIN.rods
    assert found.steps == sum(len(run.t) - 1 for run in runs)
    assert found.nfev == sum(run.nfev for run in runs)
    assert found.njev == sum(run.njev for run in runs)


@pytest.mark.parametrize("method", sorted(set(METHODS) - IMPLICIT))
def test_an_explicit_method_pays_for_stiffness_and_an_implicit_one_does_not(method):
    def steps(by, tau):
        return solve(by, tau, rtol=1e-4, atol=1e-8).steps

    # It may go about τ at a step, whatever is asked for: ten times as stiff, ten times the steps.
    assert 5.0 < steps(method, 1e-4) / steps(method, 1e-3) < 12.0
    assert steps("Radau", 1e-7) < 1.5 * steps("Radau", 1e-3)


@pytest.mark.parametrize("method", sorted(set(METHODS) - IMPLICIT))
def test_an_explicit_method_ends_in_an_error_rather_than_in_hours(method):
    with pytest.raises(StepBudgetError, match=f"{method} took 400 steps") as caught:
        solve(method, 1e-9, step_budget=400)
    assert isinstance(caught.value, RigError)
    assert "1e-09 s" in caught.value.hint
    assert "Radau, BDF or LSODA" in caught.value.hint


def test_the_budget_is_for_all_legs_together_and_to_the_last_step():
    taken = solve("RK45", 1e-3, rtol=1e-5)
    assert solve("RK45", 1e-3, rtol=1e-5, step_budget=taken.steps) == taken
    with pytest.raises(StepBudgetError):
        solve("RK45", 1e-3, rtol=1e-5, step_budget=taken.steps - 1)


def test_an_implicit_method_that_runs_out_is_not_told_to_be_implicit():
    with pytest.raises(StepBudgetError, match="BDF took 20 steps") as caught:
        solve("BDF", 1e-3, step_budget=20)
    assert "Radau" not in caught.value.hint


@pytest.mark.parametrize("method", METHODS)
def test_without_pulls_it_is_free_fall(method):
    found = solve(method, 1e-9, gains=[0.0] * 4, step_budget=200)
    wanted = fall(CHAIN, 0.0, 1.0, DROP, GRAVITY)
    assert found.fall.separation_m == 0.0
    assert close(found.fall.speed_m_s, wanted.speed_m_s, 1e-14)
    assert close(found.fall.time_s, wanted.time_s, 1e-14)


@examples(15)
@given(decades(-9, -1), decades(-9, 0), st.floats(1e-3, 2.0), st.floats(0.1, 5.0))
def test_random_pulls_by_lsoda(tau, alpha, drop, speed):
    chain = Chain((3.0, 2.0, 1.0, 1.0), (0.0, 0.2, 0.25, 0.9))
    case = chain, kicks(chain, [alpha] * 4, 4 / 3), drop, GRAVITY, tau, speed
    found = integrate_contact(*case, method="LSODA", rtol=1e-9, atol=1e-14 * alpha).fall
    wanted = contact_fall(*case)
    # The tolerance holds for Δz itself, however small.
    assert close(found.separation_m, wanted.separation_m, 1e-6)
    assert close(found.speed_m_s, wanted.speed_m_s, 1e-6)
    assert close(found.time_s, wanted.time_s, 1e-6)


@pytest.mark.parametrize("drop", [0.0, 0.5])
@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_a_chain_that_starts_on_the_surface_or_above_it(drop, speed):
    case = CHAIN, GAINS, drop, GRAVITY, 1e-3, speed
    found = integrate_contact(*case, method="DOP853").fall
    wanted = contact_fall(*case)
    assert close(found.separation_m, wanted.separation_m, 1e-7)
    assert close(found.time_s, wanted.time_s, 1e-7)


@pytest.mark.parametrize("tau", [0.0, -1.0, math.nan, math.inf])
def test_a_contact_time_must_be_above_zero(tau):
    with pytest.raises(DomainError, match="a contact time of"):
        solve("Radau", tau)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"rtol": 1e-16}, "rtol"),
        ({"rtol": 1.0}, "rtol"),
        ({"rtol": math.nan}, "rtol"),
        ({"atol": -1e-9}, "atol"),
        ({"gains": [-0.1] * 4}, "pushes the chain up"),
    ],
)
def test_other_bad_input(how, message):
    with pytest.raises(DomainError, match=message):
        solve("Radau", 1e-3, **how)


def test_an_unknown_method():
    with pytest.raises(DomainError, match="no method 'Euler'") as caught:
        solve("Euler", 1e-3)
    assert "DOP853" in caught.value.hint


@pytest.mark.parametrize("drop", [0.0, 0.18])
def test_without_gravity_or_speed_there_is_no_fall(drop):
    with pytest.raises(DomainError, match="never falls"):
        integrate_contact(CHAIN, GAINS, drop, 0.0, 1e-3)


def test_the_closed_form_needs_no_scipy():
    tree = ast.parse((MODEL / "contact.py").read_text())
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert not any((module or "").startswith("scipy") for module in modules)
    assert "rig.model.contact_ode" not in modules
