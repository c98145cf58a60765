"""The benchmark's own arithmetic: dials doubled, rivals on a perfect fall, bias and coverage."""

from __future__ import annotations

import math
from dataclasses import asdict

import pytest

from rig.bench.accuracy import Errors
from rig.bench.dials import DOUBLED, doubled
from rig.bench.rivals import plain_fit, two_gate_timer
from sim.dials import Dials, read_dials
from sim.scene import read_settings
from tests.analysis.drops import UNIFORM, case


@pytest.mark.parametrize("dial", DOUBLED)
def test_doubled_is_twice_the_default(dial):
    settings = read_settings(doubled("sim://?rod_sd=0.3mm" if dial != "rod_sd" else "sim://", dial))
    expected = asdict(Dials())
    expected[dial] *= 2
    assert asdict(read_dials(settings)) == pytest.approx(expected, rel=1e-12, nan_ok=True)


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
            errors.add(value, 0.25, rig)
    found = errors.json()
    assert found["bias"] == pytest.approx(0.1)
    assert found["bias_over_U"] == pytest.approx(0.4)
    assert found["coverage"] == pytest.approx(4 / 6)
    assert found["coverage_se"] == pytest.approx(math.sqrt(1 / 3) / math.sqrt(3))
    assert found["bias_se"] == pytest.approx(math.sqrt((0 + 0.09 + 0.09) / 2) / math.sqrt(3))
