"""The bench of the resolved world, and its falls in the paper's figures."""

import csv

import pytest

from bench.__main__ import main
from bench.studies import resolved_paper
from rig import cli

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


@pytest.mark.parametrize(("number", "lines"), [(3, 9), (4, 18)])
def test_figures_with_resolved_falls(number, lines, tmp_path, monkeypatch):
    monkeypatch.setattr(
        resolved_paper, "_ensembles", lambda *scene: [ensemble(i) for i in scene[-1]]
    )
    monkeypatch.setattr(resolved_paper, "INCLINES", tuple(10.0 * n for n in range(9)))
    assert main(["resolved", "--paper", str(number), "-o", str(tmp_path)]) == 0
    with (tmp_path / f"figure-{number}-resolved.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    assert len(rows) == lines
    if number == 3:
        assert [float(rows[8][name]) for name in ("separation_m", "separation_sd_m")] == [
            pytest.approx(0.11),
            pytest.approx(0.02 / 2**0.5),
        ]
    plain = tmp_path / "plain.svg"
    assert cli.main(["predict", "--figure", str(number), "-o", str(plain)]) == 0
    drawn = tmp_path / f"figure-{number}-resolved.svg"
    assert drawn.read_text() != plain.read_text()
