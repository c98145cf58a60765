"""Coverage of intervals on many rigs: whose runs are chosen, how they are judged, what is kept."""

from __future__ import annotations

import csv
import json

import pytest

from bench import coverage as bench_coverage
from bench.__main__ import main
from bench.studies.coverage import CASES, FULL, GRADED, MISFITS, STEEP, Held, held, merged, sessions
from rig.analysis.result import Measured
from rig.bench.falls import with_setting
from rig.ports import read_settings
from rig.protocol import reader
from rig.protocol.plan import runs
from sim.dials import read_dials
from sim.scene import choose_world
from tests.analysis.drops import PROTOCOLS, UNIFORM


def test_each_rig_has_one_drop_at_each_incline():
    planned = {run.number: run for run in runs(UNIFORM)}
    found = sessions(UNIFORM, STEEP, 13)
    assert found[0] == found[12]  # twelve repeats
    assert len({number for one in found for number in one}) == 12 * len(STEEP)
    for one in found:
        assert sorted(planned[number].incline_deg for number in one) == [*STEEP]


def test_every_case_is_a_world_that_there_is():
    for case in CASES:
        url = "sim://?stated=1"
        for name, value in case.settings.items():
            url = with_setting(url, name, value)
        read_dials(choose_world(read_settings(url))[1])
        reader.read(PROTOCOLS / case.protocol)
    assert len({case.name for case in CASES}) == len(CASES)


def test_every_wrong_rig_is_one_that_can_be():
    sizes = {fault.name: [size for size, _ in fault.rigs(FULL.protocol())] for fault in MISFITS}
    assert sizes == {fault.name: [*fault.sizes] for fault in MISFITS}


@pytest.fixture(scope="module")
def graded() -> Held:
    (case,) = [one for one in CASES if one.name == "model, graded"]
    assert case.protocol == GRADED
    return held(str(PROTOCOLS), case, [1])


def test_a_rig_s_drops_are_set_beside_the_truth(graded):
    whole = merged([graded, graded]).json()
    assert whole["drops"] == 8
    assert whole["void_share"] == whole["wrong"] == 0
    quantities = whole["quantities"]
    assert quantities["separation_m"]["n"] == quantities["separation_m, 40°"]["n"] == 8
    assert quantities["mean speed_m_s"]["n"] == quantities["drag_per_m"]["n"] == 2
    for one in quantities.values():
        assert 0.0 < one["rms"] < 2.0 * one["mean_U95"]


def test_a_drop_is_quiet_only_where_nothing_is_said():
    found = Held()
    found.verdicts.update(accepted=3, marginal=1, void=2)
    found.beyond = 1
    found.add("speed_m_s", Measured(7.1, 0.1), 7.0, 1, 40.0)
    whole = found.json()
    assert (whole["void_share"], whole["marginal_share"]) == (0.2, 0.2)
    assert whole["quantities"]["speed_m_s, 40°"]["bias"] == pytest.approx(0.1)


class Here:
    """A pool of this process alone."""

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    map = staticmethod(map)


def test_the_command_leaves_page_and_table(tmp_path, monkeypatch, capsys, graded):
    monkeypatch.setattr(bench_coverage, "ProcessPoolExecutor", Here)
    monkeypatch.setattr(bench_coverage, "held", lambda *_: graded)
    monkeypatch.setattr(bench_coverage, "misfits", lambda *_: iter([("clock -0.3 %", graded)]))
    assert main(["coverage", "-o", str(tmp_path), "--rigs", "9"]) == 0
    said = capsys.readouterr().out
    assert "SIMULATED DATA" in said
    assert "clock -0.3 %" in said
    whole = json.loads((tmp_path / "coverage.json").read_text())
    assert [*whole["cases"]] == [case.name for case in CASES]
    assert whole["cases"]["model"]["drops"] == 8  # nine rigs are two parts
    with (tmp_path / "coverage.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    assert {row["case"] for row in rows} == {*whole["cases"]}
    assert "in U95" in (tmp_path / "coverage.md").read_text("utf-8")


def test_a_case_that_is_none_is_named(tmp_path, capsys):
    assert main(["coverage", "-o", str(tmp_path), "--only", "steel"]) == 2
    assert "there are model; resolved, damped strings; " in capsys.readouterr().err
