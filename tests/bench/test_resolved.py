"""The bench of the resolved world, and its falls in the paper's figures."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ET

import pytest

from bench.__main__ import main
from bench.studies import resolved as bench_resolved
from rig import cli
from rig.bench import resolved_paper
from rig.bench.resolved_paper import Ensemble
from rig.report.files import figure_file
from rig.report.film import film_figure
from tests.report.test_figures import FILM


def ensemble(incline: float) -> Ensemble:
    times = [n / 960 for n in range(20)]
    track = {
        "times_s": times,
        "impact_top_m": [0.1 - 5.0 * t for t in times],
        "free_top_m": [0.2 - 4.0 * t for t in times],
    }
    return Ensemble(incline, (0.1, 0.12), (6.9, 7.1), (0.01, 0.02), (track, track))


@pytest.mark.parametrize("number", [3, 4])
def test_figures_with_resolved_falls(number, tmp_path, monkeypatch):
    some = [ensemble(10.0 * n) for n in range(9)]
    monkeypatch.setattr(resolved_paper, "uniform", lambda: some)
    monkeypatch.setattr(resolved_paper, "graded", lambda: some[4])
    target = tmp_path / "figure.svg"
    assert cli.main(["predict", "--figure", str(number), "--resolved", "-o", str(target)]) == 0
    assert "resolved" not in target.with_suffix(".csv").read_text()
    with (tmp_path / "figure-resolved.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    assert len(rows) == (9 if number == 3 else 18)
    plain = tmp_path / "plain.svg"
    assert cli.main(["predict", "--figure", str(number), "-o", str(plain)]) == 0
    assert target.read_text() != plain.read_text()


WORK = [
    {"changed": changed, "step_s": step, "touch_s": touch, "rms_m": rms, "worst_m": 2 * rms,
     "cpu_s": cpu}
    for changed, step, touch, rms, cpu in (
        ("step", 1e-5, 2e-4, 2e-5, 1.0), ("step", 5e-6, 2e-4, 5e-6, 2.0),
        ("touch", 1e-5, 2e-4, 1e-4, 1.0), ("touch", 5e-6, 1e-4, 0.0, 2.0),
    )
] + [
    {"changed": "25 rods", "step_s": 1e-5, "touch_s": 2e-4, "rms_m": None, "worst_m": None,
     "cpu_s": 0.1},
]  # fmt: skip


def test_error_against_run_time_is_kept_and_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(bench_resolved, "measure", lambda module: WORK)
    assert main(["resolved", "--work", "-o", str(tmp_path)]) == 0
    assert "0.0200" in capsys.readouterr().out
    with (tmp_path / "resolved-work.csv").open(newline="") as table:
        errors = [row["rms_m"] for row in csv.DictReader(table)]
    assert errors == ["2e-05", "5e-06", "0.0001", "0.0", ""]
    ET.fromstring((tmp_path / "resolved-work.svg").read_text())


def test_what_others_published_is_kept_and_printed(tmp_path, monkeypatch, capsys):
    lines = [
        {"what": "ahead (m)", "of": "15 rods", "mean": 0.055, "sd": 0.005, "n": 16},
        {"what": "T/T_ff", "of": "20 rods", "mean": 0.926, "sd": None, "n": 1},
    ]
    monkeypatch.setattr(bench_resolved, "measure", lambda module: lines)
    assert main(["resolved", "--published", "-o", str(tmp_path)]) == 0
    assert "0.9260" in capsys.readouterr().out
    with (tmp_path / "resolved-published.csv").open(newline="") as table:
        assert [row["sd"] for row in csv.DictReader(table)] == ["0.005", ""]


def test_a_fall_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(bench_resolved, "film", lambda folder, incline: FILM)
    assert main(["resolved", "--film", "40", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "resolved-fall.svg").read_text() == figure_file(
        film_figure(FILM), "svg"
    ).decode()
