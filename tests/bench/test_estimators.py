"""Every estimator on the same simulated drops."""

from __future__ import annotations

import json

import pytest

from bench.__main__ import main
from bench.studies.baselines import TimerReading, line_fit
from bench.studies.estimators import mean_of_draws
from rig.analysis.drop import fit_drop
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case
from tests.cli.lab import short


def test_line_fits_are_near_on_a_perfect_rig():
    one = case(UNIFORM, Dials.quiet(), incline=40.0)
    reading = line_fit(UNIFORM, one.drop, one.scale.hz)
    assert reading.separation_m == pytest.approx(one.truth.separation_raw_m, rel=0.02)
    assert reading.speed_m_s == pytest.approx(one.truth.speed_m_s, rel=0.02)
    assert line_fit(UNIFORM, one.with_edges([]).drop, one.scale.hz) is None


def test_draws_of_no_spread_are_the_adjustment_itself():
    """The curve is of the same function as the results beside it, on a rig with everything off."""
    one = case(UNIFORM, Dials(skew_sd=1e-3), incline=40.0)
    fit = fit_drop(one.protocol, one.run, one.drop, one.scale)[1]
    known = one.analyze().quantities
    reading = mean_of_draws(fit, 1, 3, spread=0.0)
    assert reading == TimerReading(known["separation_m"].value, known["speed_m_s"].value)


def test_the_bench_draws_one_picture(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("bench.studies.estimators.TRIALS", (10, 10**6))  # the ends only
    protocol = tmp_path / "p.yaml"
    protocol.write_text(short("40 deg", 4), "utf-8")
    arguments = ["estimators", "-o", str(tmp_path / "o"), "--protocol", str(protocol)]
    assert main([*arguments, "--repeats", "4", "--budget", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    names = [one["name"] for one in found["estimators"]]
    assert {"one-run fit", "session fit", "Monte Carlo, draws"} <= set(names)
    assert found["times_lstsq"].keys() == {"one-run fit", "joint fit alone"}
    assert found["times_lstsq"]["one-run fit"] > 1.0  # it solves at least one such system
    assert any("M = 1e+06" in one for one in found["left_out"])
    assert {path.suffix for path in (tmp_path / "o").iterdir()} == {".csv", ".json", ".md", ".svg"}
    assert "SIMULATED" in (tmp_path / "o" / "estimators.svg").read_text("utf-8")
