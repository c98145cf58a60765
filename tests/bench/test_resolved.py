"""The bench of the resolved world, and its falls in the paper's figures."""

import csv

import pytest

from bench.__main__ import main
from bench.studies import resolved as bench_resolved
from rig import cli
from rig.bench import resolved_paper
from rig.report.canvas import figure_file
from rig.report.film import film_figure
from tests.report.test_figures import FILM

pytestmark = pytest.mark.usefixtures("loops_compiled")


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


def test_a_fall_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(bench_resolved, "film", lambda folder, incline: FILM)
    assert main(["resolved", "--film", "40", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "resolved-fall.svg").read_text() == figure_file(
        film_figure(FILM), "svg"
    ).decode()
