"""Gravity of the free chain: right where the rig is right, and a witness where it is not."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.drop import DropCase
from rig.analysis.gravity import check_gravity, free_gravity
from rig.clock.calibration import TimeScale
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import FENCE, HZ, SINGLE, UNIFORM, Case, case, first_run, with_dials

SCENES = {"fence": FENCE, "uniform": UNIFORM}
QUIET = Dials.quiet()


def read(one: Case, scale: TimeScale | None = None, protocol=None):
    """The result with its gravity, however wrong the drop is."""
    stated = replace(one, protocol=protocol or one.protocol, scale=scale or one.scale)
    result, fit = stated.read(explain=False)
    return replace(result, gravity=result.quantities.get("gravity_m_s2") or free_gravity(fit))


def gravity(one: Case, scale: TimeScale | None = None, protocol=None):
    return read(one, scale, protocol).gravity


def check(one: Case, scale: TimeScale, protocol=None):
    good = replace(read(one, scale, protocol), verdict="accepted")
    return check_gravity(protocol or one.protocol, [good])


@pytest.mark.parametrize("scene", SCENES)
def test_without_disturbance_it_is_the_scenes(scene):
    protocol = SCENES[scene]
    one = case(protocol, QUIET)
    assert gravity(one).value == pytest.approx(protocol.gravity.value, rel=2e-6)


def test_how_much_edges_scatter_is_seen_and_not_taken_for_granted():
    """What is stated counts as one edge of hundreds, be it ten times too much."""
    one = case(UNIFORM, with_dials(jitter_sd=2e-6), incline=40.0)
    u = [
        gravity(one, protocol=replace(UNIFORM, priors=replace(UNIFORM.priors, edge_floor=floor))).u
        for floor in (10e-6, 100e-6)
    ]
    assert u[1] < 1.1 * u[0]


def test_a_wrong_clock_shows_twice():
    wrong = 3000e-6
    one = case(UNIFORM, QUIET, incline=40.0)
    shown = gravity(one, TimeScale(HZ * (1.0 + wrong), 1e-6)).value
    assert shown / UNIFORM.gravity.value - 1.0 == pytest.approx(2.0 * wrong, rel=0.01)
    found = check(one, TimeScale(HZ * (1.0 + wrong), 1e-6))
    assert not found.agrees
    assert np.sign(found.normalized_error) == np.sign(wrong)
    # A clock that is known no better than that is not contradicted.
    assert check(one, TimeScale(HZ * (1.0 + wrong), 5e-3)).agrees


def test_a_protocols_own_uncertainty_counts():
    one = case(UNIFORM, Dials(), incline=40.0)
    said = check(one, one.scale).json()
    assert said["agrees"] is True
    assert (said["drops"], said["stated_m_s2"]) == (1, UNIFORM.gravity.value)
    assert said["gravity_m_s2"]["U95"] < 0.01
    off = replace(UNIFORM, gravity=Quantity(9.85, 0.0))
    unsure = replace(UNIFORM, gravity=Quantity(9.85, 0.05))
    assert not check(one, one.scale, off).agrees
    assert check(one, one.scale, unsure).agrees


def test_the_same_rig_again_is_not_better_known():
    """What beams and rods are off by is the same in every drop."""
    dials, run = with_dials(rod_sd=0.3e-3, gate_sd=0.2e-3), first_run(UNIFORM, 40.0)
    drops = [case(UNIFORM, dials, run=run + n) for n in range(4)]
    rows = [DropCase(UNIFORM, one.run, one.drop, one.scale).summary().result for one in drops]
    alone, together = check_gravity(UNIFORM, rows[:1]), check_gravity(UNIFORM, rows)
    assert together.drops == 4
    assert together.measured.u > 0.9 * alone.measured.u


def test_where_nothing_falls_freely_past_beams_there_is_no_check():
    single = case(SINGLE, QUIET)
    assert check(single, single.scale) is None
    void = case(UNIFORM, QUIET, incline=40.0).with_edges([])
    assert check_gravity(UNIFORM, [void.analyze()]) is None
