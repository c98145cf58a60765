"""Error against run time: what is deterministic in it, and that its references hold."""

import csv
import json
import xml.etree.ElementTree as ET

import pytest

from rig import cli
from rig.bench import methods, precision
from rig.bench.precision_reference import (
    discrete_truth,
    scenes,
)
from rig.bench.stability import relative_error

UNIFORM, GRADED, MANY, EXPONENTIAL = scenes()


# References


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
