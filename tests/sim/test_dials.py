"""Dials as they are written in a URL's query."""

import math
from dataclasses import asdict, replace

import pytest

from rig.errors import InputError
from rig.protocol.protocol import Contact
from rig.units import Quantity
from sim.dials import Dials, read_dials
from sim.scene import set_scene
from tests.sim.falls import PROTOCOLS, UNIFORM

RESOLVED = {"dynamics": "resolved"}
UNSET = {"restitution", "friction", "reference"}  # not-a-number, which equals nothing


def same(one: Dials, other: Dials) -> bool:
    """Equal, with not-a-number equal to itself."""
    pairs = zip(asdict(one).values(), asdict(other).values(), strict=True)
    return all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in pairs)


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


BAD = [
    ({"protocol": ""}, "sim:// needs a scene to simulate", "protocol=FILE"),
    ({"protocol": "nowhere.yaml"}, "nowhere.yaml", "rig ready"),
    ({"seed": "one"}, "seed: 'one' is not a whole number", ""),
    ({"pace": "slow"}, "pace: 'slow' is not a whole number", ""),
    ({"truth": "no/such/folder/truth.jsonl"}, "truth: cannot write no/such", ""),
    ({"dynamics": "real"}, "dynamics: 'real'", "model or resolved"),
    ({"quiet": ""}, "quiet: ", ""),
    ({"quiet": "yes"}, "quiet: ", ""),
    ({"stated": "2"}, "stated: 2 is neither 0 nor 1", ""),
    ({"quiet": "1", "stated": "1"}, "quiet and stated are two rigs", "set one of them"),
    ({"skew": "1"}, "unknown dial 'skew'", "did you mean 'skew_sd'?"),
    ({"quite": "1"}, "unknown dial 'quite'", "did you mean 'quiet'?"),
    ({"stringrestitution": "1"}, "'stringrestitution'", "did you mean 'string_restitution'?"),
    ({"xyz": "1"}, "unknown dial 'xyz'", "dials are quiet, stated, dynamics, pace, "),
    ({"string_restitution": "0.5"}, "string_restitution is a dial of", "add dynamics=resolved"),
    ({"skew_sd": "2 mm"}, "skew_sd: 2 mm is a length", ""),
    ({"missed": "-1 %"}, "missed: -1 % is outside of what is accepted", "0 to 1"),
    ({"delay": "-1 s"}, "delay: -1 s is outside of what is accepted", "0 or more s"),
    ({"string_restitution": "0.05"} | RESOLVED, "string_restitution: 0.05", "0.1 to 1"),
    ({"board_time": "2 mm"} | RESOLVED, "board_time: 2 mm", ""),
    ({"rods_touch": "0.5"} | RESOLVED, "rods_touch: 0.5 is neither 0 nor 1", ""),
    ({"spin_sd": "3"} | RESOLVED, "spin_sd: ", ""),
    ({"swing_sd": "1e9 m/s"} | RESOLVED, "swing_sd: 1e9 m/s", "0 to 10 m/s"),
    ({"tilt_sd": "30 deg"} | RESOLVED, "in each other as it hangs", "how chains hang"),
    ({"drag": "1000"} | RESOLVED, "more than 5 s", "drag"),
    ({"hang_sd": "9 m"} | RESOLVED, "as it hangs", ""),
    ({"restitution": "-0.37"} | RESOLVED, "restitution -0.37 is not between", "rods land"),
]


@pytest.mark.parametrize(("settings", "says", "hint"), BAD)
def test_bad_settings_are_refused_with_what_to_do(settings, says, hint):
    scene = {"protocol": str(PROTOCOLS / "inclined-uniform.yaml")}
    with pytest.raises(InputError) as caught:
        set_scene("sim", scene | settings)
    assert says in caught.value.message
    assert hint in (caught.value.hint or "")
    assert caught.value.exit_code == 2
