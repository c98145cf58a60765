"""Error against processor time: what is deterministic in it, and that errors are errors."""

import csv
import json
import xml.etree.ElementTree as ET

import pytest

from rig import cli
from rig.bench.problems import beam_fit, contact, fall_time, problems
from rig.bench.references import own_error
from rig.bench.work import EPSILON, relative_error


@pytest.mark.parametrize("number", range(5))
def test_methods_come_nearer_to_the_reference_as_they_are_asked_to(number):
    problem = [*problems(quick=True)][number]
    exact = problem.exact(**problem.inputs)
    assert own_error(problem.exact, problem.inputs) < 1e-45
    for method in problem.methods:
        errors = [
            max(relative_error(x, exact[name]) for name, x in method.solve(value).values.items())
            for value in (method.values[0], method.values[-1 if len(method.values) < 9 else 7])
        ]
        assert errors[-1] < 1e-4 or len(method.values) == 1, method.name
        assert errors[-1] <= max(errors[0], 1e4 * EPSILON), method.name  # κ of the fit is 1e3


def test_impacts_at_once_are_the_limit_of_short_ones():
    errors = []
    for contact_s in (1e-4, 1e-6):
        problem = contact(contact_s)
        separation = problem.methods[0].solve(0.0).values["separation"]
        errors.append(relative_error(separation, problem.exact(**problem.inputs)["separation"]))
    assert errors[1] == pytest.approx(errors[0] / 100, rel=0.1)


def test_the_command_writes_all_of_it(tmp_path, monkeypatch, capsys):
    some = [beam_fit(0.5e-3), fall_time()]
    monkeypatch.setattr("rig.commands.bench_precision.problems", lambda quick: some)
    assert cli.main(["bench", "precision", "--quick", "-o", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "left out: fit-0.5mm, Cholesky" in printed
    points = json.loads((tmp_path / "precision.json").read_text("utf-8"))["points"]
    with (tmp_path / "precision.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["method"] for row in rows] == [point["method"] for point in points]
    assert all(0.0 < point["lower_s"] <= point["cpu_s"] <= point["upper_s"] for point in points)
    for picture in ("precision", "precision-fit-0.5mm", "precision-fall-time"):
        ET.fromstring((tmp_path / f"{picture}.svg").read_text("utf-8"))
