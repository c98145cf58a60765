"""The photogate as drawn: `rig gate` against ngspice, and its resistors, which can be bought."""

from pathlib import Path

import pytest
from hypothesis import given

from rig.errors import InputError
from rig.model import photogate
from rig.model.photogate import next_standard
from tests.firmware.toolchain import FIRMWARE, need
from tests.model.chains import decades
from tests.programs import run_program
from tests.refusals import refused
from tests.tables import cases

NAMED = {"distance_m": 0.06, "slit_m": 0.5e-3, "led": "TSAL6100", "detector": "BPW85C"}
DECK = Path(__file__).with_name("photogate.cir").read_text("ascii")


def spice(deck, tmp_path):
    need("ngspice")
    (path := tmp_path / "deck.cir").write_text(deck)
    done = run_program("ngspice", "-b", path, code=None)
    found = {}
    for line in done.stdout.splitlines():
        name, equals, value = line.partition("=")
        if equals and name.strip() in {"goes", "back", "lit"}:
            found[name.strip()] = float(value.split()[0])
    assert len(found) == 3, done.stdout + done.stderr
    return found


@pytest.mark.parametrize("pull", [5.0, 3.3])
def test_the_threshold_is_at_half_light_whatever_the_supply_of_the_board(tmp_path, pull):
    gate = photogate.design_photogate(**NAMED)
    lit = gate["lit, V (twice the threshold)"] / gate["load resistor, Ω"]
    deck = DECK.format(pull=pull, lit=lit, load=gate["load resistor, Ω"], half=pull / 2)
    found = spice(deck, tmp_path)
    assert found["lit"] == pytest.approx(2.44, rel=0.01)
    dark, light = 1 - (found["goes"] - 1e-3) / 10e-3, (found["back"] - 12e-3) / 10e-3
    assert (dark + light) / 2 == pytest.approx(0.5, abs=0.03)
    assert light > dark
    told = gate["hysteresis, % of the light"] / 100
    assert 0.6 * told < light - dark < 1.4 * told


@cases
def test_a_gate_of_these_parts_has_these_figures(distance_m, slit_m, led, detector, figures):
    gate = photogate.design_photogate(distance_m, slit_m, led, detector)
    assert [*gate.values()] == pytest.approx(figures, rel=1e-9)
    assert gate["LED current, weakest parts, mA"] <= 50


def test_too_little_light_is_said():
    dark = {**NAMED, "detector": "BPW85", "led": "TSAL6400"}
    refused(InputError, "too little light", photogate.design_photogate, **dark)


@pytest.mark.parametrize("board", ["rp2040", "atmega2560", "atmega328p"])
def test_the_drawing_has_the_resistors_that_were_computed(board):
    gate = photogate.design_photogate(**NAMED)
    drawing = (FIRMWARE / board / "wiring.svg").read_text("utf-8")
    assert f"{gate['load resistor, Ω'] / 1e3:g} kΩ" in drawing
    assert f"{gate['LED resistor, Ω']:g} Ω" in drawing
    assert "74HC14" not in drawing


SERIES = [1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3, 3.9, 4.7, 5.6, 6.8, 8.2]  # E12 of IEC 60063


@given(decades(0, 6))
def test_a_resistor_is_the_next_one_of_its_series(ohm):
    all_there_are = [first * 10.0**power for power in range(8) for first in SERIES]
    wanted = min(one for one in all_there_are if one > 0.999 * ohm)
    assert next_standard(ohm) == pytest.approx(wanted, rel=1e-9)
