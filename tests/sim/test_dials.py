"""Dials as they are written in a URL's query."""

import math
from dataclasses import asdict, replace

from rig.errors import InputError
from rig.protocol.protocol import Contact
from rig.units import Quantity
from sim.dials import Dials, read_dials
from sim.scene import set_scene
from tests.refusals import refused
from tests.sim.falls import PROTOCOLS, UNIFORM
from tests.tables import cases

UNSET = {"restitution", "friction", "reference"}  # not-a-number, which equals nothing


def same(one: Dials, other: Dials) -> bool:
    """Equal, with not-a-number equal to itself."""
    pairs = zip(asdict(one).values(), asdict(other).values(), strict=True)
    return all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in pairs)


@cases
def test_a_dial_with_its_unit_changes_nothing_else(name, text, value):
    dials = asdict(read_dials({name: text}))
    assert dials.pop(name) == value
    assert all(dials[other] == getattr(Dials(), other) for other in dials if other not in UNSET)


def test_quiet_switches_every_disturbance_off():
    quiet = asdict(read_dials({"quiet": "1"}))
    assert quiet.pop("delay") == Dials().delay > 0
    assert quiet.pop("stall") == Dials().stall > 0  # how long, where any is
    for name in UNSET:
        assert math.isnan(quiet.pop(name))
    assert set(quiet.values()) == {0.0}


def test_stated_dials_are_the_protocol_s_own_but_for_those_that_are_set():
    u, gates = Quantity(0.0, 7e-3), replace(UNIFORM.gates, height_u=1e-3, datum_u=2e-3)
    priors = replace(UNIFORM.priors, hang=3e-3, side=4e-3, beam_offset=5e-3, jitter=6e-6)
    protocol = replace(UNIFORM, gates=gates, priors=priors, contact=Contact(u, Quantity(0.0, 8e-3)))
    dials = read_dials({"stated": "1", "datum_sd": "9 mm"})
    assert (dials.drop_error, dials.skew_sd) == (1.0, Dials().skew_sd)
    found = dials.on(protocol)
    assert (found.gate_sd, found.datum_sd, found.hang_sd, found.side_sd) == (1e-3, 9e-3, 3e-3, 4e-3)
    assert (found.beam_sd, found.jitter_sd, found.contact_sd, found.strike_sd) == (
        5e-3, 6e-6, 7e-3, 8e-3,
    )  # fmt: skip
    assert same(Dials().on(protocol), Dials())


@cases
def test_bad_settings_are_refused_with_what_to_do(settings, says, hint):
    scene = {"protocol": str(PROTOCOLS / "inclined-uniform.yaml")}
    error = refused(InputError, "", set_scene, "sim", scene | settings)
    assert says in error.message
    assert hint in (error.hint or "")
    assert error.exit_code == 2
