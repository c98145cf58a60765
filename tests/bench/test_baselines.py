"""A plain timer on a perfect fall, and falls without a device."""

import pytest

from bench.studies.baselines import two_gate_timer
from bench.studies.falls import Asked, falls, simulation
from sim.dials import Dials
from tests.analysis.drops import PROTOCOLS, SINGLE, UNIFORM, case


def test_a_plain_timer_is_near_on_a_perfect_rig():
    """It takes the speed between two gates for free fall: a few per cent of Δz and V."""
    one = case(UNIFORM, Dials.quiet(), incline=40.0)
    reading = two_gate_timer(UNIFORM, one.drop, one.scale.hz)
    assert reading.separation_m == pytest.approx(one.truth.separation_raw_m, rel=0.05)
    assert reading.speed_m_s == pytest.approx(one.truth.speed_m_s, rel=0.12)
    assert two_gate_timer(UNIFORM, one.with_edges([]).drop, one.scale.hz) is None


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
