"""Resistors that can be bought; `tests/firmware/test_photogate.py` looks at the circuit."""

import pytest
from hypothesis import given

from rig.model.photogate import next_standard
from tests.model.chains import decades

SERIES = [1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3, 3.9, 4.7, 5.6, 6.8, 8.2]  # E12 of IEC 60063


@given(decades(0, 6))
def test_a_resistor_is_the_next_one_of_its_series(ohm):
    all_there_are = [first * 10.0**power for power in range(8) for first in SERIES]
    wanted = min(one for one in all_there_are if one > 0.999 * ohm)
    assert next_standard(ohm) == pytest.approx(wanted, rel=1e-9)
