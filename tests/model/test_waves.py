"""Waves on the chain against its own speed (section III.D)."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import DomainError
from rig.model.impact import alpha_inclined
from rig.model.waves import waves
from tests.model.chains import close, decades


def test_the_papers_typical_speeds():
    found = waves(0.1, 1 / 3)
    assert found.transverse == pytest.approx(math.sqrt(0.1), rel=1e-15)
    assert found.torsional == pytest.approx(math.sqrt(0.3), rel=1e-15)
    assert found.notes == ()


@given(decades(-12, 0.5), decades(-3, 0))
def test_noted_exactly_where_a_wave_is_not_slower(alpha, inertia):
    found = waves(alpha, inertia)
    assert close(found.transverse**2, alpha, 1e-15)
    assert close(found.torsional**2 * inertia, alpha, 1e-15)
    notes = " ".join(found.notes)
    assert ("transverse" in notes) == (found.transverse >= 1.0)
    assert ("torsional" in notes) == (found.torsional >= 1.0)


@given(st.floats(0.0, 0.5), st.floats(0.5001, 1.0))
def test_no_wave_outruns_the_chain_where_energy_is_kept_and_rods_are_heavy_ended(alpha, inertia):
    assert waves(alpha, inertia).notes == ()


def test_the_left_end_of_figure_6_is_outside_the_argument():
    def at(inertia):
        return waves(alpha_inclined(0.5, 0.2, 40.0, inertia), inertia)

    assert at(1 / 3).torsional == pytest.approx(0.682, abs=1e-3)
    assert at(0.161).notes == ()
    assert "torsional" in at(0.160).notes[0]
    assert at(1e-6).torsional == pytest.approx(1.807, abs=1e-3)


@pytest.mark.parametrize(("alpha", "inertia"), [(-0.1, 0.3), (0.1, 0.0), (math.nan, 0.3)])
def test_there_are_no_waves_without_tension_or_inertia(alpha, inertia):
    with pytest.raises(DomainError, match="no waves"):
        waves(alpha, inertia)
