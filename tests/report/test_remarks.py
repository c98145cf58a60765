"""What is said of the air, and that a session in air says it."""

from __future__ import annotations

import json

import pytest

from rig.report.remarks import air_lines
from tests.cli.lab import rig, short


def learned(value: float, u: float) -> dict:
    unknowns = [{"name": "clock", "value": [1.0], "u": [1e-9]}]
    return {"learned": {"unknowns": [*unknowns, {"name": "drag", "value": [value], "u": [u]}]}}


def test_air_that_may_be_none_is_not_mentioned():
    for nothing in ({}, {"learned": None}, learned(3e-6, 1e-6), learned(-3e-6, 1e-6)):
        assert air_lines(nothing) == []


def test_air_is_said_with_its_uncertainty():
    (line,) = air_lines(learned(0.0312345, 1e-5))
    assert "κ = 0.031234 ± 0.000020 per m" in line


def test_a_run_in_air_tells_of_it(tmp_path):
    protocol, session = tmp_path / "air.yaml", tmp_path / "air.session"
    protocol.write_text(short(), "utf-8")
    done = rig("run", protocol, "--port", "sim://?seed=2&drag=0.03&skew_sd=1ms",
               "--session", session, "--yes")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "air: takes κv² from g, κ = 0.0" in done.stdout
    (one,) = [
        one
        for one in json.loads(rig("analyze", session, "--json").stdout)["learned"]["unknowns"]
        if one["name"] == "drag"
    ]
    assert one["value"][0] == pytest.approx(0.03, abs=4 * one["u"][0])
