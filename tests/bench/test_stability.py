"""Extremes: no error beyond what the inputs' rounding explains, and the verdicts can fail."""

import json
from dataclasses import replace

import pytest

from rig import cli
from rig.bench import extremes as bench
from rig.bench.stability import examine, of_fall


@pytest.mark.parametrize("share", [5, pytest.param(1, marks=pytest.mark.slow)])
def test_the_quick_study_finds_no_fault(share, tmp_path, monkeypatch):
    """Of every two extremes together one pair in five here: each extreme is in one."""
    some = [*bench.pairs()][::share]
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
    right = bench.fall

    def wrong(*scene):
        end = right(*scene)
        return replace(end, **{name: getattr(end, name) * (1 + 1e-13)})

    monkeypatch.setattr(bench, "fall", wrong)
    verdicts = [row.verdict for row in examine(of_fall(bench.Extreme("as in the paper")))]
    assert verdicts.count("FAILED") == 1
