"""Coverage of intervals on rigs of a hypercube: how they are drawn, judged and reported."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from bench.__main__ import main
from bench.studies import coverage as study
from bench.studies.coverage import (
    Interval,
    Rig,
    RigResult,
    draw_rigs,
    measure,
    summarize,
    worst_tenth,
)
from rig.analysis.result import Measured
from rig.ports import read_settings
from rig.protocol import reader
from rig.protocol.plan import runs
from sim.dials import read_dials
from sim.scene import choose_world
from tests.analysis.drops import PROTOCOLS

FOLDER = str(PROTOCOLS)


def test_a_cube_has_a_rig_in_each_layer_of_each_axis():
    rigs = draw_rigs(FOLDER, "resolved", 22, seed=3)
    assert rigs == draw_rigs(FOLDER, "resolved", 22, seed=3)
    layouts = [rig.layout for rig in rigs]
    assert {layouts.count(name) for name in study.LAYOUTS} == {2}
    layers = np.floor(22 * (np.array([rig.incline_deg for rig in rigs]) - 35.0) / 45.0)
    assert len({*layers}) >= 21  # inclines are rounded
    for name, (low, high, _) in study.DIALS.items():
        values = sorted(rig.dials[name] for rig in rigs)
        assert low <= values[0] < low + (high - low) / 22 + 1e-5
        assert high - (high - low) / 22 - 1e-5 < values[-1] <= high


@pytest.mark.parametrize("world", study.WORLDS)
def test_every_rig_is_one_that_there_can_be(world, tmp_path):
    for rig in draw_rigs(FOLDER, world, 33, seed=1):
        protocol = reader.parse(rig.text)
        inclines = [run.incline_deg for run in runs(protocol)]
        planned = {*range(0, 90, 10)} if world == "coefficients" else {rig.incline_deg}
        assert len(inclines) == rig.drops
        assert {*inclines} == planned
        counts = [sum(gate.side == side for gate in protocol.gates.gates)
                  for side in ("impact", "free")]  # fmt: skip
        if "+" in rig.layout:
            assert " + ".join(map(str, counts)) == rig.layout
        if "graded" not in rig.layout:
            assert study.RODS[0] <= rig.rods <= study.RODS[1]
        settings = read_settings(rig.ask(tmp_path).url)
        assert reader.read(settings.pop("protocol")).gates == protocol.gates
        read_dials(choose_world(settings)[1])


def rig_result(number: int, errors: list[float], **changes: object) -> RigResult:
    rig = draw_rigs(FOLDER, "resolved", 1, seed=number)[0]
    parts = {name: getattr(rig, name) for name in Rig.__slots__} | {"number": number} | changes
    result = RigResult(Rig(**parts), seconds=0.5)
    for error in errors:
        result.verdicts["accepted"] += 1
        result.intervals.append(Interval("separation_m", Measured(1.0 + error, 0.5), 1.0))
    return result


def test_the_worst_tenth_is_chosen_by_both_measures():
    good = [rig_result(n, [0.1] * 4) for n in range(1, 19)]
    often, far = rig_result(19, [1.1, 1.2, 1.1, 0.1]), rig_result(20, [0.1, 0.1, 0.1, 9.0])
    silent = rig_result(21, [])
    worst = worst_tenth([*good, often, far, silent])
    held, error = ([one.rig.number for one in rigs] for rigs in worst.values())
    assert held[:2] == [19, 20]
    assert error[:2] == [20, 19]
    assert far.worst is not None
    assert far.row()["worst_ratio"] == pytest.approx(9.0 / far.worst.measured.expanded)
    assert worst_tenth([silent]) == {}


def test_shares_are_from_rig_to_rig_and_leave_out_what_must_be_void():
    one, other = rig_result(1, [0.1, 0.2]), rig_result(2, [0.1, 5.0])
    one.verdicts["void"], one.beyond = 2, 1
    found = summarize([one, other])
    assert (found["rigs"], found["drops"], found["beyond"]) == (2, 6, 1)
    assert found["void_share"] == pytest.approx(1 / 5)
    assert found["quantities"]["separation_m"]["coverage"] == 0.75
    assert found["quantities"]["separation_m"]["coverage_se"] >= 0.25


def test_a_rig_s_drops_are_set_beside_the_truth():
    (rig,) = [one for one in draw_rigs(FOLDER, "model", 12, seed=1) if one.number == 2]
    (found,) = measure([rig])
    assert found.verdicts.total() == rig.drops
    names = {one.quantity for one in found.intervals}
    assert {"separation_m", "speed_strike_m_s", "release_skew_s"} <= names
    assert {"mean separation_m", "gravity_m_s2"} <= {one.quantity for one in found.session}
    assert all(one.ratio < 3.0 for one in [*found.intervals, *found.session])


@pytest.fixture
def here(monkeypatch):
    """Work in this process."""
    monkeypatch.setattr(
        study, "results", lambda calls, _: (call(*inputs) for call, *inputs in calls)
    )


def test_the_command_leaves_page_and_table(tmp_path, monkeypatch, capsys, here):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(study, "DROPS", (1,))
    words = ["coverage", "-o", str(tmp_path), "--rigs", "2", "--world", "resolved", "model"]
    assert main(words) == 0
    assert "SIMULATED DATA" in capsys.readouterr().out
    whole = json.loads((tmp_path / "coverage.json").read_text())
    assert [*whole] == ["resolved", "model"]
    with (tmp_path / "coverage.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    assert [row["number"] for row in rows] == ["1", "2"] * 2
    page = (tmp_path / "coverage.md").read_text("utf-8")
    assert "worst tenth, fewest held:" in page


def test_a_rig_is_drawn_again_by_its_number(tmp_path, here):
    words = ["coverage", "-o", str(tmp_path), "--rigs", "12", "--world", "model", "--only", "2"]
    assert main(words) == 0
    rows = json.loads((tmp_path / "coverage.json").read_text())["model"]["rigs"]
    assert [row["number"] for row in rows] == [2]
    assert rows[0]["heights"] == draw_rigs(FOLDER, "model", 12, seed=1)[1].heights
    assert main([*words[:-1], "13"]) == 2


def test_a_world_without_its_engine_says_how_to_get_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(study, "find_spec", lambda name: None)
    assert main(["coverage", "-o", str(tmp_path), "--world", "mujoco"]) == 2
    assert "pip install mujoco" in capsys.readouterr().err
