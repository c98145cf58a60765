"""Studies for users: precision, stability, and what a scene leaves out; never how long it takes."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest

from rig import cli
from rig.bench import extremes, scenes
from rig.bench.problems import beam_fit, contact, fall_time, problems
from rig.bench.references import own_error
from rig.bench.scenes import ladder
from rig.bench.stability import examine, of_fall
from rig.bench.work import EPSILON, relative_error
from tests.tables import read_csv


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


def test_the_command_writes_all_of_it(tmp_path, monkeypatch, call):
    some = [beam_fit(0.5e-3), fall_time()]
    monkeypatch.setattr("rig.commands.bench_precision.problems", lambda quick: some)
    printed = call("bench", "precision", "--quick", "-o", tmp_path).out
    assert "left out: fit-0.5mm, Cholesky" in printed
    points = json.loads((tmp_path / "precision.json").read_text("utf-8"))["points"]
    rows = read_csv(tmp_path / "precision.csv")
    assert [row["method"] for row in rows] == [point["method"] for point in points]
    assert all(0.0 < point["lower_s"] <= point["cpu_s"] <= point["upper_s"] for point in points)
    for picture in ("precision", "precision-fit-0.5mm", "precision-fall-time"):
        ET.fromstring((tmp_path / f"{picture}.svg").read_text("utf-8"))


SOME = slice(1, None, 7)


@pytest.mark.parametrize("share", [SOME, pytest.param(slice(None), marks=pytest.mark.slow)])
def test_the_quick_study_finds_no_fault(share, tmp_path, monkeypatch):
    """Of every two extremes together one pair in seven here: each extreme is in one."""
    every = [*extremes.pairs()]
    some = every[share]
    of_all, of_some = ({end for one in of for end in one.name.split(" + ")} for of in (every, some))
    assert of_some == of_all
    monkeypatch.setattr("rig.bench.stability.pairs", lambda: some)
    assert cli.main(["bench", "stability", "--quick", "-o", str(tmp_path)]) == 0
    study = json.loads((tmp_path / "stability.json").read_text("utf-8"), parse_constant=pytest.fail)
    assert study["counts"]["FAILED"] == 0
    for row in study["rows"]:  # whatever is not simply right says why
        assert (row["verdict"] == "exact") == (row["note"] == ""), row
    # Every quantity is there, and each is lost by the equations as printed somewhere.
    for quantity in ("alpha", "separation", "speed", "time"):
        errors = [row["naive_error"] or 0.0 for row in study["rows"] if row["quantity"] == quantity]
        assert max(errors) > 1e-6


@pytest.mark.parametrize("name", ["separation_m", "speed_m_s", "time_s"])
def test_a_wrong_digit_is_seen(monkeypatch, name):
    right = extremes.fall

    def wrong(*scene):
        end = right(*scene)
        return replace(end, **{name: getattr(end, name) * (1 + 1e-13)})

    monkeypatch.setattr(extremes, "fall", wrong)
    verdicts = [row.verdict for row in examine(of_fall(extremes.Extreme("as in the paper")))]
    assert verdicts.count("FAILED") == 1


def test_a_scene_gains_nothing_that_it_does_not_have(monkeypatch, call, tmp_path):
    steps = {name: ladder()[name] for name in ("free fall", "whole")}
    monkeypatch.setattr(scenes, "ladder", lambda: dict(steps))
    monkeypatch.setattr(scenes, "_PROBES", 1)
    ready, kept = tmp_path / "ready", tmp_path / "kept"
    ready.mkdir()
    (ready / "mine.yaml").write_text(ladder()["inclined"], "utf-8")
    command = ["bench", "scenes", "--rounds", "1", "--protocols", str(ready)]
    assert "no scene gained what it does not have" in call(*command, "-o", kept).out
    listed = json.loads((kept / "scenes.json").read_text("utf-8"))["scenes"]
    assert [scene["scene"] for scene in listed] == [*steps, "mine"]
    assert [scene["calls"]["g(θ)"] for scene in listed] == [0, 30, 1]
    assert listed[0]["calls"]["falls"] == 0
    assert [line["scene"] for line in read_csv(kept / "scenes.csv")] == [*steps, "mine"]
    assert (kept / "scenes.svg").read_text("utf-8").lstrip().startswith("<?xml")


def test_what_a_scene_gains_fails(monkeypatch, call, tmp_path):
    parts = {**scenes.PARTS, "gates": {"rig.model.chain"}}  # as if falls needed gates
    monkeypatch.setattr(scenes, "PARTS", parts)
    monkeypatch.setattr(scenes, "_PROBES", 1)
    monkeypatch.setattr(scenes, "ladder", lambda: {"whole": ladder()["level surface"]})
    command = ["bench", "scenes", "--rounds", "1", "--protocols", "nowhere"]
    assert "whole gained rig.model.chain (gates)" in call(*command, "-o", tmp_path, code=1).out
    (level,) = json.loads((tmp_path / "scenes.json").read_text("utf-8"))["scenes"]
    assert (level["calls"]["g(θ)"], level["calls"]["falls"]) == (0, 1)
