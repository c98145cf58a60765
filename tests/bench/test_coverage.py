"""Coverage of intervals on rigs of a hypercube: how they are drawn, judged and reported."""

import csv
import json

import pytest

from bench.__main__ import main
from bench.studies import coverage as study


@pytest.fixture
def here(monkeypatch):
    """Work in this process."""
    monkeypatch.setattr(
        study, "results", lambda calls, _: (call(*inputs) for call, *inputs in calls)
    )


@pytest.mark.usefixtures("loops_compiled")
def test_the_command_leaves_page_and_table(tmp_path, monkeypatch, capsys, here):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    worlds = {name: world._replace(repeats=(1,)) for name, world in study.WORLDS.items()}
    monkeypatch.setattr(study, "WORLDS", worlds)
    words = [
        "coverage",
        "-o",
        str(tmp_path),
        "--rigs",
        "2",
        "--world",
        "resolved",
        "model",
        "usual",
    ]
    assert main(words) == 0
    assert "SIMULATED DATA" in capsys.readouterr().out
    whole = json.loads((tmp_path / "coverage.json").read_text())
    assert [*whole] == ["resolved", "model", "usual"]
    with (tmp_path / "coverage.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
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
