"""Dials as they are written in a URL's query."""

import math
from dataclasses import asdict, fields, replace

import pytest

from rig.errors import InputError
from rig.protocol.protocol import Contact
from rig.units import Quantity
from sim.dials import Dials, read_dials
from tests.sim.falls import UNIFORM

TIMES = ("skew_sd", "delay", "delay_sd", "jitter_sd", "latency", "stall")
LENGTHS = (
    "hang_sd", "side_sd", "rod_sd", "width_sd", "gate_sd", "datum_sd", "beam_sd", "contact_sd",
    "strike_sd",
)  # fmt: skip
SHARES = ("missed", "chatter", "string", "bounce", "corrupt", "lose", "stalled")
FACTORS = (
    "drop_error", "impact_error", "impulse_sd", "friction", "restitution", "clock", "drift",
    "wander", "reference", "drag",
)  # fmt: skip
UNSET = {"restitution", "friction", "reference"}  # not-a-number, which equals nothing


NAMES = {field.name for field in fields(Dials)}


def same(one: Dials, other: Dials) -> bool:
    """Equal, with not-a-number equal to itself."""
    pairs = zip(asdict(one).values(), asdict(other).values(), strict=True)
    return all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in pairs)


def test_every_dial_is_of_a_known_kind():
    assert {*TIMES, *LENGTHS, *SHARES, *FACTORS} == NAMES


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("skew_sd", "4ms", 0.004),
        ("jitter_sd", "1.5 µs", 1.5e-6),
        ("delay", "0.02 s", 0.02),
        ("rod_sd", "0.3 mm", 0.3e-3),
        ("gate_sd", "200 um", 0.2e-3),
        ("clock", "-1300 ppm", -1300e-6),
        ("clock", "−0.13 %", -1300e-6),
        ("missed", "2 %", 0.02),
        ("missed", "2%", 0.02),
        ("missed", "0.02", 0.02),
        ("restitution", "-0.37", -0.37),
        ("drop_error", "3", 3.0),
        ("corrupt", "0", 0.0),
        ("lose", "100 %", 1.0),
    ],
)
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


@pytest.mark.parametrize("name", ["quiet", "stated"])
@pytest.mark.parametrize("text", ["yes", "true", "", "2"])
def test_quiet_and_stated_are_0_or_1(name, text):
    with pytest.raises(InputError, match=name):
        read_dials({name: text})


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


@pytest.mark.parametrize(
    ("typo", "meant"),
    [
        ("skew", "skew_sd"),
        ("mised", "missed"),
        ("corupt", "corrupt"),
        ("quite", "quiet"),
        ("stringrestitution", "string_restitution"),
    ],
)
def test_an_unknown_dial_is_named_and_a_near_one_proposed(typo, meant):
    with pytest.raises(InputError, match=repr(typo)) as caught:
        read_dials({typo: "1"})
    assert caught.value.hint == f"did you mean '{meant}'?"
    assert caught.value.exit_code == 2
