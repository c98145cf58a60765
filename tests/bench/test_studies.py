"""Studies of the software: what they count is so, and each leaves its page and its table."""

import json
import os

import numpy as np
import pytest

from bench.__main__ import main
from bench.studies import bulk, coverage, diagnoses, resolved_paper
from bench.studies.baselines import two_gate_timer
from bench.studies.dataset import scores
from bench.studies.layout_catalogue import LAYOUTS
from bench.studies.layouts import DISTURBANCES
from bench.studies.wrong_rigs import WRONG_RIGS
from rig import cli
from rig.protocol.measurable import check_measurable
from rig.protocol.reader import parse
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case
from tests.tables import read_csv


def test_a_plain_timer_is_near_on_a_perfect_rig():
    """It takes the speed between two gates for free fall: a few per cent of Δz and V."""
    one = case(UNIFORM, Dials.quiet(), incline=40.0)
    reading = two_gate_timer(UNIFORM, one.drop, one.scale.hz)
    assert reading.separation_m == pytest.approx(one.truth.separation_raw_m, rel=0.05)
    assert reading.speed_m_s == pytest.approx(one.truth.speed_m_s, rel=0.12)
    assert two_gate_timer(UNIFORM, one.with_edges([]).drop, one.scale.hz) is None


def test_scores_are_those_of_gneiting_and_raftery():
    drops = [{"session": "s", "run": run, "attempt": 1} for run in (1, 2, 3)]
    truths = [{**drop, "speed_m_s": 2.0} for drop in drops]
    stated = [(2.0, 0.1), (2.3, 0.1), (None, None)]  # held; 0.2 m/s outside; void
    readings = [
        {**drop, "entrant": "e", "quantity": "speed_m_s", "value": value, "U95": U95}
        for drop, (value, U95) in zip(drops, stated, strict=True)
    ]
    (row,) = scores(truths, readings)
    assert (row["drops"], row["coverage"]) == (3, 0.5)
    assert row["void"] == pytest.approx(1 / 3)
    assert row["interval_score"] == pytest.approx(0.2 + 0.5 * 40 * 0.2)


ONE_OF_A_KIND = diagnoses.LAYOUTS[0], *diagnoses.LAYOUTS[7:]
"""Two chains alike and unlike, a single one, a fence: what other layouts add are gates."""


def test_every_fault_is_of_some_layout_and_another_rig_than_the_stated_one():
    for fault in WRONG_RIGS:
        every = [(one, [*fault.rigs(one.protocol())]) for one in ONE_OF_A_KIND]
        # Each layout's smallest and largest fault: what lies between is made alike.
        rigs = [(one, rig) for one, sizes in every for rig in (*sizes[:1], *sizes[1:][-1:])]
        assert rigs, fault.name
        for layout, (size, text) in rigs:
            assert parse(text).gates
            otherwise = fault.settings(size) or fault.slow(size)
            assert otherwise or json.loads(text) != json.loads(layout.protocol())


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda one: f"{one.kind.name}: {one.heights}")
def test_every_layout_is_a_protocol_that_can_be_measured(layout):
    protocol = parse(layout.protocol())
    check_measurable(protocol)
    assert len(protocol.gates.gates) == len(layout.impact) + len(layout.free)
    assert (protocol.surface is None) == (layout.kind.scene == "fence")
    assert protocol.two_chains == (layout.kind.scene == "two")


def test_the_bench_keeps_table_and_page(tmp_path, capsys):
    arguments = ["layouts", "-o", str(tmp_path), "--only", "3 rods: 2 + 2"]
    assert main([*arguments, "--drops", "2", "--jobs", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["disturbance"] for one in found["layouts"]] == [*DISTURBANCES]
    for one in found["layouts"]:
        assert (one["drops"], one["wrong_edges"]) == (2, 0)
    quiet = found["layouts"][0]
    assert (quiet["void_share"], quiet["beyond"]) == (0.0, 0)
    assert quiet["error_rms"] < 1e-5
    assert (tmp_path / "layouts.csv").read_text("utf-8").count("3 rods,") == 3
    page = (tmp_path / "layouts.md").read_text("utf-8")
    assert "36, 117 + 32.4, 108" in page
    assert "bench layouts --drops 2`" in page


needs_compiler = pytest.mark.skipif(
    bulk.find_compiler() is None and not os.environ.get("CI"), reason="there is no C compiler here"
)


@needs_compiler
def test_all_loops_fall_as_the_model_does(tmp_path):
    batch = bulk.draw_falls(300)
    methods = bulk.methods(tmp_path)
    wanted = np.array(methods.pop("Python (rig)")(batch))
    for name, compute in methods.items():
        # A compiler may fuse a product and a sum into one rounding.
        rtol = 1e-5 if "32" in name else 2e-14
        np.testing.assert_allclose(compute(batch), wanted, rtol=rtol, atol=0.0, err_msg=name)


def test_the_command_measures_limits(monkeypatch, capsys):
    monkeypatch.delenv("CI", raising=False)
    assert main(["bulk", "--falls", "10", "--rounds", "1", "--json"]) == 0
    study = json.loads(capsys.readouterr().out)
    assert {point["value"] for point in study["points"]} == {1.0, 10.0}
    assert any("square roots" in limit for limit in study["limits"])


@pytest.fixture
def here(monkeypatch):
    """Work in this process."""
    monkeypatch.setattr(
        coverage, "results", lambda calls, _: (call(*inputs) for call, *inputs in calls)
    )


@pytest.mark.slow
@pytest.mark.usefixtures("loops_compiled")
def test_the_command_leaves_page_and_table(tmp_path, monkeypatch, capsys, here):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    worlds = {name: world._replace(repeats=(1,)) for name, world in coverage.WORLDS.items()}
    monkeypatch.setattr(coverage, "WORLDS", worlds)
    words = ["coverage", "--rigs", "2", "--world", "resolved", "model", "usual", "-o"]
    assert main([*words, str(tmp_path)]) == 0
    assert "SIMULATED DATA" in capsys.readouterr().out
    whole = json.loads((tmp_path / "coverage.json").read_text())
    assert [*whole] == ["resolved", "model", "usual"]
    rows = read_csv(tmp_path / "coverage.csv")
    assert [row["number"] for row in rows] == ["1", "2"] * 3
    page = (tmp_path / "coverage.md").read_text("utf-8")
    assert "worst tenth, fewest held:" in page
    usual = whole["usual"]["all"]
    assert usual["drops"] == usual["quantities"]["speed_m_s"]["n"] == 18
    assert usual["edges"] > 10_000
    assert usual["wrong_edges"] == usual["void_share"] == 0
    assert 0.0 < usual["quantities"]["speed_m_s"]["rms"] < 0.02
    assert usual["quantities"]["separation_m"]["coverage"] == 1.0
    assert "mean speed_m_s" in whole["model"]["sessions"]
    for row in whole["usual"]["agreement"]:  # of a model that made the drops
        assert (row["sessions"], row["drops"]) == (2, 9)
        assert row["p_below_0.01"] == 0.0


def ensemble(incline: float):
    times = [n / 960 for n in range(20)]
    track = {
        "times_s": times,
        "impact_top_m": [0.1 - 5.0 * t for t in times],
        "free_top_m": [0.2 - 4.0 * t for t in times],
    }
    names = ("separation_strike_m", "speed_strike_m_s", "contact_height_m")
    return [
        {"incline_deg": incline, "track": track, **dict.fromkeys(names, number)}
        for number in (0.1, 0.12)
    ]


@pytest.mark.parametrize(("number", "lines"), [(3, 9), (4, 18)])
def test_figures_with_resolved_falls(number, lines, tmp_path, monkeypatch):
    monkeypatch.setattr(
        resolved_paper, "_ensembles", lambda *scene: [ensemble(i) for i in scene[-1]]
    )
    monkeypatch.setattr(resolved_paper, "INCLINES", tuple(10.0 * n for n in range(9)))
    assert main(["resolved", "--paper", str(number), "-o", str(tmp_path)]) == 0
    rows = read_csv(tmp_path / f"figure-{number}-resolved.csv")
    assert len(rows) == lines
    if number == 3:
        assert [float(rows[8][name]) for name in ("separation_m", "separation_sd_m")] == [
            pytest.approx(0.11),
            pytest.approx(0.02 / 2**0.5),
        ]
    plain = tmp_path / "plain.svg"
    assert cli.main(["predict", "--figure", str(number), "-o", str(plain)]) == 0
    assert (tmp_path / f"figure-{number}-resolved.svg").read_text() != plain.read_text()
