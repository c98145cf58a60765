"""A plain timer on a perfect fall, and falls without a device."""

import pytest

from bench.studies.baselines import two_gate_timer
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case


def test_a_plain_timer_is_near_on_a_perfect_rig():
    """It takes the speed between two gates for free fall: a few per cent of Δz and V."""
    one = case(UNIFORM, Dials.quiet(), incline=40.0)
    reading = two_gate_timer(UNIFORM, one.drop, one.scale.hz)
    assert reading.separation_m == pytest.approx(one.truth.separation_raw_m, rel=0.05)
    assert reading.speed_m_s == pytest.approx(one.truth.speed_m_s, rel=0.12)
    assert two_gate_timer(UNIFORM, one.with_edges([]).drop, one.scale.hz) is None
