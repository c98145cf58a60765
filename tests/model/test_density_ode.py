"""Chains of any density: against even ones, closed forms and chains of many rods."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model import continuum, density_ode
from rig.model.chain import Chain
from rig.model.density import Exponential, Uniform
from rig.model.fall import fall
from tests.examples import examples
from tests.model.chains import close, decades
from tests.waiting import PATIENCE_S

LENGTH, GRAVITY = 1.165, 9.81
TIGHT = 1e-10  # at the default tolerance of 1e-12 a step; 5e-11 is the worst seen


def ode(density, alpha, reach, drop, gravity=GRAVITY, start=0.0, **how):
    return density_ode.end(density, alpha, 1.0, reach, drop, gravity, start, **how)


def check(found, wanted, relative):
    assert close(found.separation_m, wanted.separation_m, relative)
    assert close(found.speed_m_s, wanted.speed_m_s, relative)
    assert close(found.lay_down_s, wanted.lay_down_s, relative)
    assert close(found.time_s, wanted.time_s, relative)


@examples(40)
@given(
    decades(-12, 0).filter(lambda alpha: alpha <= 0.5),
    decades(-9, 3),
    st.one_of(st.just(0.0), decades(-12, 6)),
    st.one_of(st.just(0.0), decades(-3, 3)),
)
def test_an_even_density_is_the_uniform_chain(alpha, reach, drop, start):
    found = ode(Uniform(LENGTH), alpha, reach, drop, start=start)
    chain = continuum.UniformChain(LENGTH, reach, alpha, 1.0, drop, GRAVITY, start)
    check(found, continuum.end(chain), TIGHT)


@pytest.mark.parametrize(
    ("method", "rtol", "accuracy"),
    [
        ("RK23", 1e-6, 1e-4),
        ("RK45", 1e-9, 1e-7),
        ("DOP853", 1e-12, 1e-11),
        ("DOP853", 3e-14, 1e-13),
        ("Radau", 1e-9, 1e-8),
        ("BDF", 1e-9, 1e-6),
        ("LSODA", 1e-11, 1e-8),
    ],
)
@pytest.mark.parametrize("drop", [0.0, 0.18])
def test_every_method_comes_to_the_same_end(method, rtol, accuracy, drop):
    found = ode(Uniform(LENGTH), 0.155, 0.0647, drop, method=method, rtol=rtol)
    chain = continuum.UniformChain(LENGTH, 0.0647, 0.155, 1.0, drop, GRAVITY)
    check(found, continuum.end(chain), accuracy)
    assert found.evaluations > found.steps > 3


def test_a_finer_tolerance_costs_more_and_gives_more():
    exact = continuum.end(continuum.UniformChain(LENGTH, 0.0647, 0.155, 1.0, 0.18, GRAVITY))
    runs = [ode(Uniform(LENGTH), 0.155, 0.0647, 0.18, rtol=rtol) for rtol in (1e-4, 1e-8, 1e-12)]
    errors = [abs(run.separation_m / exact.separation_m - 1) for run in runs]
    assert errors[0] > errors[1] > errors[2]
    assert runs[0].evaluations < runs[1].evaluations < runs[2].evaluations


def test_without_gravity():
    chain = continuum.UniformChain(LENGTH, 0.0647, 0.155, 1.0, 0.18, 0.0, 3.0)
    found = ode(Uniform(LENGTH), 0.155, 0.0647, 0.18, gravity=0.0, start=3.0)
    check(found, continuum.end(chain), TIGHT)


@pytest.mark.parametrize("alpha", [1e-12, 0.155, 0.5])
@pytest.mark.parametrize("powers", [1.0, 12.0, 40.0, -6.0])
def test_an_exponential_density_without_gravity(alpha, powers):
    """With c = ℓ + γs, ℓ = z₀/(decades · ln 10): V = V_h ((c e^z₀/ℓ − ℓ)/(c e^z/ℓ − ℓ))^(αℓ/c)."""
    reach, start = 0.05, 3.0
    found = ode(Exponential(LENGTH, powers), alpha, reach, 0.0, gravity=0.0, start=start)
    with mp.workdps(50):
        z0, r, a = mp.mpf(LENGTH), mp.mpf(reach), mp.mpf(alpha)
        ell = z0 / (mp.mpf(powers) * mp.log(10))
        c = ell + r

        def speed(z):
            grown = (c * mp.exp(z0 / ell) - ell) / (c * mp.exp(z / ell) - ell)
            return start * grown ** (a * ell / c)

        time = mp.quad(lambda z: 1 / speed(z), mp.linspace(0, z0, 9))
        wanted = z0 - start * time, speed(mp.mpf(0)), time
    assert close(found.separation_m, float(wanted[0]), TIGHT)
    assert close(found.speed_m_s, float(wanted[1]), TIGHT)
    assert close(found.lay_down_s, float(wanted[2]), TIGHT)


@pytest.mark.parametrize("powers", [2.0, 12.0, -3.0])
@pytest.mark.parametrize("drop", [0.0, 0.18])
def test_many_rods_reach_an_exponential_density_at_first_order(powers, drop):
    reach, alpha = 0.1, 0.155
    found = ode(Exponential(LENGTH, powers), alpha, reach, drop)
    errors = []
    for rods in (4001, 8001):
        heights = tuple(LENGTH * k / (rods - 1) for k in range(rods))
        masses = tuple(10.0 ** (-powers * z / LENGTH) for z in heights)
        discrete = fall(Chain(masses, heights), alpha, reach * (rods - 1) / LENGTH, drop, GRAVITY)
        errors.append(
            (
                discrete.separation_m / found.separation_m - 1,
                discrete.speed_m_s / found.speed_m_s - 1,
                discrete.time_s / found.time_s - 1,
            )
        )
    for coarse, fine in zip(*errors, strict=True):
        assert abs(fine) < 2e-3
        assert 0.85 < math.log2(coarse / fine) < 1.25


@examples(15)
@given(st.floats(-5.0, 15.0), decades(-3, 1), st.one_of(st.just(0.0), decades(-6, 2)))
def test_separation_does_not_depend_on_gravity(powers, reach, drop):
    density = Exponential(LENGTH, powers)
    here, there = (ode(density, 0.2, reach, drop, g) for g in (9.81, 1.62))
    assert close(here.separation_m, there.separation_m, TIGHT)
    assert close(here.speed_m_s / there.speed_m_s, math.sqrt(9.81 / 1.62), TIGHT)


@examples(15)
@given(st.floats(-5.0, 10.0), decades(-3, 1), st.one_of(st.just(0.0), decades(-6, 2)))
def test_a_bottom_heavy_chain_gains_more(powers, reach, drop):
    flat, steep = (ode(Exponential(LENGTH, p), 0.2, reach, drop) for p in (powers, powers + 1.0))
    assert steep.separation_m > flat.separation_m
    assert steep.speed_m_s > flat.speed_m_s


def test_small_alpha_keeps_its_digits():
    density = Exponential(LENGTH, 12.0)
    tiny, small = (ode(density, alpha, 0.05, 0.18) for alpha in (1e-200, 1e-100))
    assert close(tiny.separation_m * 1e100, small.separation_m, 1e-14)
    assert ode(density, 0.0, 0.05, 0.18).separation_m == 0.0


def test_says_what_it_cannot_do():
    with pytest.raises(DomainError, match="infinitely fast"):
        ode(Uniform(LENGTH), 0.1, 0.0, 0.18)
    with pytest.raises(DomainError, match="never falls"):
        ode(Uniform(LENGTH), 0.1, 0.05, 0.18, gravity=0.0)


def test_nothing_else_in_the_model_loads_scipy():
    program = """
import importlib, pkgutil, sys
import rig.model
names = [m.name for m in pkgutil.iter_modules(rig.model.__path__)]
assert "continuum" in names and "density_ode" in names
for name in names:
    if not name.endswith("_ode"):
        importlib.import_module(f"rig.model.{name}")
assert "scipy" not in sys.modules
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 0, done.stderr
