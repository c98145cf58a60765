"""The benchmark's own arithmetic: dials doubled, baselines on a perfect fall, bias and coverage."""

from __future__ import annotations

import math
from dataclasses import asdict

import pytest

from bench.studies.accuracy import acceptance_table, blocks, failures, short_sessions
from bench.studies.baselines import plain_fit, two_gate_timer
from bench.studies.disturbances import DOUBLED, STACK
from bench.studies.errors import Errors
from rig.analysis.result import Measured
from rig.bench.falls import Asked, falls, simulation, with_settings
from rig.errors import RigError
from rig.ports import read_settings
from rig.protocol.plan import runs
from sim.dials import Dials, read_dials
from tests.analysis.drops import PROTOCOLS, SINGLE, UNIFORM, case


def test_doubled_is_twice_the_default():
    dials = asdict(read_dials(read_settings(with_settings("sim://", DOUBLED))))
    expected = {name: size * (1 + (name in DOUBLED)) for name, size in asdict(Dials()).items()}
    assert dials == pytest.approx(expected, rel=1e-12, nan_ok=True)
    assert set(STACK) < set(DOUBLED)


def test_a_plain_timer_is_near_on_a_perfect_rig():
    """It takes the speed between two gates for free fall: a few per cent of Δz and V."""
    one = case(UNIFORM, Dials.quiet(), incline=40.0)
    reading = two_gate_timer(UNIFORM, one.drop, one.scale.hz)
    assert reading.separation_m == pytest.approx(one.truth.separation_raw_m, rel=0.05)
    assert reading.speed_m_s == pytest.approx(one.truth.speed_m_s, rel=0.12)
    plain_fit(UNIFORM, one.drop, one.analyze(), one.scale.hz)
    assert two_gate_timer(UNIFORM, one.with_edges([]).drop, one.scale.hz) is None


def test_bias_and_coverage_are_as_sure_as_there_are_rigs():
    errors = Errors()
    for rig, values in enumerate(([0.1, 0.1], [0.3, 0.5], [-0.2, -0.2])):
        for value in values:
            errors.add(Measured(1.0 + value, 0.125), 1.0, rig)
    found = errors.json()
    assert found["times_u"] == pytest.approx(8.0 * math.sqrt(0.44 / 6))
    assert found["bias"] == pytest.approx(0.1)
    assert found["bias_over_U"] == pytest.approx(0.1 / Measured(0.0, 0.125).expanded)
    assert found["coverage"] == pytest.approx(4 / 6)
    assert found["coverage_se"] == pytest.approx(math.sqrt(1 / 3) / math.sqrt(3))
    assert found["bias_se"] == pytest.approx(math.sqrt((0 + 0.09 + 0.09) / 2) / math.sqrt(3))


SOURCE = str(PROTOCOLS / "single-chain.yaml")


def test_falls_without_a_device_are_the_simulation_s():
    one = case(SINGLE, Dials(skew_sd=4e-3), seed=2, run=3)
    url, quiet = (simulation(SOURCE, dials) for dials in ({"skew_sd": "4 ms"}, {"quiet": "1"}))
    found = list(falls([Asked(url, [1, 2], [[1], [2, 3]]), Asked(quiet, [1], [[1]])]))
    assert [(fall.seed, fall.drop.run) for fall in found] == [(1, 1), (2, 2), (2, 3), (1, 1)]
    assert found[0].truth["speed_m_s"] != found[3].truth["speed_m_s"]
    last = found[2]
    assert [tuple(edge) for edge in last.truth["edges"]] == [*map(tuple, one.truth.edges)]
    assert [edge[1:] for edge in last.drop.edges] == [edge[1:] for edge in one.drop.edges]
    assert last.truth["speed_m_s"] == one.truth.speed_m_s


def test_a_simulation_that_gives_up_is_said(capfd):
    url = simulation(SOURCE, {"no_such_dial": "1"})
    with pytest.raises(RigError, match="exit code 1"):
        list(falls([Asked(url, [1], [[1]])]))
    assert "no_such_dial" in capfd.readouterr().err


def test_every_planned_run_has_its_turn():
    sessions = blocks(UNIFORM, 27)
    planned = {run.number: run for run in runs(UNIFORM)}
    assert sorted(number for one in sessions for number in one) == sorted(planned)
    for one in sessions:
        assert "".join(str(planned[number].impact) for number in one) == "ABBA"
        assert len({planned[number].incline_deg for number in one}) == 1


def test_a_rig_s_drops_are_judged_by_their_truth():
    found = short_sessions(SOURCE, "sim://", 1)
    assert found["verdicts"].keys() <= {"accepted", "marginal"}
    assert found["edges_matched"] > 1000
    assert found["edges_given_to_a_wrong_rod"] == 0
    assert 0.0 < found["speed_rms_relative"] < 3e-3
    assert found["quantities"]["speed_m_s"]["n"] == sum(found["verdicts"].values()) == 4
    lines = acceptance_table({"default": found})
    assert len(lines) == 2  # a heading, and nothing beyond a limit
    assert lines[1].split()[:2] == ["default", "4"]


GOOD = {
    "n": 100, "rms": 0.05e-3, "bias": 0.0, "worst": 1e-4, "mean_U95": 1e-4, "bias_over_U": 0.05,
    "coverage": 0.95, "bias_se": 1e-6, "coverage_se": 0.01,
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, []),
        ({"rms": 0.6e-3}, ["rms error of Δz"]),
        ({"bias_over_U": -0.13}, ["bias of Δz is -0.13 U"]),
        ({"bias_over_U": -0.13, "bias_se": 2e-6}, []),
        ({"coverage": 0.90}, ["coverage of Δz is 90.0%"]),
        ({"coverage": 0.995}, ["coverage of Δz is 99.5%"]),
        ({"coverage": 0.98}, []),
    ],
)
def test_what_is_beyond_a_limit_by_more_than_chance_is_said(change, said):
    found = {"edges_given_to_a_wrong_rod": 0, "quantities": {"separation_m": GOOD | change}}
    assert list(failures(found)) == said
    wrong = list(failures(found | {"edges_given_to_a_wrong_rod": 2}))
    assert wrong == ["2 edges given to a wrong rod", *said]
