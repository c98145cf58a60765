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
