"""Error against run time: what is deterministic in it, and that its references hold."""

from __future__ import annotations

import csv
import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from mpmath import mp

from rig import cli
from rig.bench import methods, precision
from rig.bench.precision_reference import (
    GATE_M,
    contact_truth,
    continuum_truth,
    discrete_truth,
    scene,
    scenes,
)
from rig.bench.stability import relative_error
from rig.errors import RigError
from rig.model import paper
from rig.model.chain import Chain
from tests.model.contact_reference import superposed_fall
from tests.model.continuum_reference import printed_squared_speed

UNIFORM, GRADED, MANY, EXPONENTIAL = scenes()
TRUTH = discrete_truth(UNIFORM)


def close(found, wanted, digits):
    return abs(mp.mpf(str(found)) / mp.mpf(str(wanted)) - 1) < mp.mpf(10) ** -digits


# References


@pytest.mark.parametrize(("incline", "separation", "speed"), [
    (0.0, "0.17762380452368596", "8.3678802518552439"),
    (30.0, "0.14455777135466808", "7.5511640917900483"),
    (40.0, "0.11546810526538031", "6.9327596650855757"),
    (60.0, "0.053585554933341692", "5.8609487859073973"),
    (80.0, "0.0098142050953198042", "5.2579813110300101"),
])  # fmt: skip
def test_the_discrete_reference_gives_the_table(incline, separation, speed):
    one = scene("", "", paper.UNIFORM, even=True, incline_deg=incline)
    found = discrete_truth(one)
    # α as a float is all that is left of the difference.
    assert close(found.separation, separation, 14.5)
    assert close(found.speed, speed, 14.5)


@pytest.mark.parametrize("tau", [1e-2, 1e-5])
def test_the_contact_reference_against_summed_pulls(tau):
    short = replace(UNIFORM, chain=Chain((1.0,) * 6, paper.UNIFORM.heights[:6]))
    found = contact_truth(short, tau)
    with mp.workdps(70):
        end = superposed_fall(
            short.chain.heights, _exact_gains(short), short.drop, short.gravity, tau, digits=90
        )
        assert close(found.separation, mp.nstr(end.separation, 60), 47)
        assert close(found.speed, mp.nstr(end.speed, 60), 47)


def _exact_gains(one):
    with mp.workdps(90):
        a, c, n = mp.mpf(one.alpha), mp.mpf(one.gamma), one.chain.rods
        return [a / (n - 1 - k + c) for k in range(n - 1)] + [mp.mpf(0)]


def test_the_continuum_reference_against_the_printed_quadrature():
    found = continuum_truth(UNIFORM)
    with mp.workdps(70):
        given = (
            mp.mpf(paper.LENGTH),
            mp.mpf(UNIFORM.gamma) * mp.mpf(UNIFORM.spacing_m),
            mp.mpf(UNIFORM.alpha),
            mp.mpf(UNIFORM.drop),
            mp.mpf(UNIFORM.gravity),
            mp.mpf(0),
        )
        time = mp.sqrt(2 * given[3] / given[4]) + mp.quad(
            lambda z: 1 / mp.sqrt(printed_squared_speed(z, *given)), [GATE_M, 0.1, 0.4, given[0]]
        )
        assert close(found.gate, mp.nstr(time, 60), 45)
        speed = mp.sqrt(printed_squared_speed(mp.mpf(0), *given))
        assert close(found.speed, mp.nstr(speed, 60), 47)


# Methods


@pytest.mark.parametrize("one", [UNIFORM, GRADED, MANY, EXPONENTIAL], ids=lambda one: one.name)
def test_the_event_exact_fall_is_exact(one):
    truth = discrete_truth(one)
    (setting,) = methods.methods(one)[0].settings
    answer = setting.solve()
    assert relative_error(answer.separation_m, truth.separation) <= 1e-14
    assert relative_error(answer.speed_m_s, truth.speed) <= 1e-14
    assert precision.absolute_error(setting.gate().time_s, truth.gate) <= 1e-14
    assert answer.evaluations == one.chain.rods


def line(name, one=UNIFORM):
    return next(method for method in methods.methods(one) if method.name == name)


def errors(method, truth):
    return [
        relative_error(setting.solve().separation_m, truth.separation)
        for setting in method.settings
    ]


@pytest.mark.parametrize("solver", ["RK45", "DOP853"])
def test_legs_are_parabolas_and_exact_at_any_tolerance(solver):
    """Free fall is of second order in time: only the event is left to be found."""
    assert max(errors(replace(line(f"legs {solver}"), settings=line(f"legs {solver}").settings[:3]),
                      TRUTH)) < 1e-13  # fmt: skip


SHORT = replace(UNIFORM, chain=Chain((1.0,) * 4, paper.UNIFORM.heights[:4]))


def by_solver(solver, tau, rtol, gains=SHORT.gains, **how):
    return methods.leg_by_leg(
        SHORT.chain, gains, SHORT.drop, SHORT.gravity, solver, rtol, tau, **how
    )


@pytest.mark.parametrize("solver", methods.SOLVERS)
@pytest.mark.parametrize("tau", [3e-2, 1e-3])
def test_every_solver_solves_impacts_that_last(solver, tau):
    truth = contact_truth(SHORT, tau)
    loose, tight = (by_solver(solver, tau, rtol) for rtol in (1e-4, 1e-8))
    off = [relative_error(one.separation_m, truth.separation) for one in (loose, tight)]
    assert off[1] < min(0.1 * off[0], 1e-4)
    assert relative_error(tight.speed_m_s, truth.speed) < 1e-6
    assert tight.evaluations > tight.steps > loose.steps > SHORT.chain.rods


@pytest.mark.parametrize("solver", sorted(methods.IMPLICIT))
def test_an_implicit_solver_does_not_pay_for_stiffness(solver):
    found = by_solver(solver, 1e-9, 1e-6, budget=10_000)
    truth = contact_truth(SHORT, 1e-9)
    assert relative_error(found.separation_m, truth.separation) < 1e-4
    assert relative_error(found.speed_m_s, truth.speed) < 1e-4


@pytest.mark.parametrize("solver", sorted(set(methods.SOLVERS) - methods.IMPLICIT))
def test_an_explicit_solver_goes_about_a_contact_time_at_a_step(solver):
    counts = [by_solver(solver, tau, 1e-4).steps for tau in (1e-4, 1e-5)]
    assert 5.0 < counts[1] / counts[0] < 12.0
    with pytest.raises(RigError, match="more than 400 evaluations"):
        by_solver(solver, 1e-9, 1e-4, budget=400)


def test_many_rods_leave_solvers_out_and_say_so():
    names = {method.name for method in methods.methods(MANY)}
    gone = dict(methods.absent(MANY))
    assert not names & set(gone)
    assert "10000 legs" in gone["legs Radau"]


# The sweep


@pytest.fixture(scope="module")
def quick():
    told: list[str] = []
    return precision.precision(quick=True, progress=told.append), told


def test_the_sweep_has_every_model_and_says_what_it_left_out(quick):
    found, told = quick
    assert {point.model for point in found.points} == {"discrete", "continuum", "contact"}
    assert all(point.lower_s <= point.median_s <= point.upper_s for point in found.points)
    assert any("RK45" in line for line in told)
    reasons = {(out.scene, out.method): out.reason for out in found.left_out}
    assert "30000 evaluations" in reasons["uniform", "contact RK45"]
    assert "like rods" in reasons["graded", "continuum, every method"]
    swept = {(p.scene, p.method, p.setting) for p in found.points}
    assert not swept & {(out.scene, out.method, out.setting) for out in found.left_out}


def test_the_cheapest_keeps_to_the_error():
    def point(method, error, median):
        return precision.Point("s", method, "discrete", "", 0.0, None, error, 0.0, None, 1, 1,
                               median, median, median, 3)  # fmt: skip

    points = [point("poor", 1e-4, 1.0), point("good", 1e-10, 2.0), point("slow", 0.0, 3.0)]
    points.append(point("V only", None, 0.1))
    found = [one.method for one in precision.cheapest(points, (1e-3, 1e-9, 1e-12))]
    assert found == ["poor", "good", "slow"]
    assert precision.cheapest(points[:1], (1e-9,))[0].method is None


def test_the_command_writes_all_of_it(quick, monkeypatch, tmp_path, capsys):
    def swept(**options):
        options["keep"](quick[0])
        return quick[0]

    monkeypatch.setattr(precision, "precision", swept)
    assert cli.main(["bench", "precision", "--quick", "-o", str(tmp_path / "new")]) == 0
    printed = capsys.readouterr().out
    assert "cheapest method" in printed
    assert "left out" in printed
    with (tmp_path / "new" / "precision.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(quick[0].points)
    text = (tmp_path / "new" / "precision.json").read_text(encoding="utf-8")
    assert json.loads(text)["gaps"]
    for name in ("uniform", "graded"):
        svg = (tmp_path / "new" / f"precision-{name}.svg").read_text(encoding="utf-8")
        ET.fromstring(svg)
