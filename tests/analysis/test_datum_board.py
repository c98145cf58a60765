"""Heights measured from the board: where rods touch follows from what they are like."""

import re
from dataclasses import replace

import numpy as np
import pytest

from rig.errors import InputError
from rig.predictions import predicted_run
from rig.protocol import contact, reader
from tests.analysis.drops import GRADED, UNIFORM, case
from tests.refusals import refused


def raised(text: str, by_mm: float) -> str:
    """Gates so much higher, and the chains as much more above the zero."""

    def higher(found: re.Match[str]) -> str:
        return f"{found[1]}{float(found[2]) + by_mm:.12g} mm"

    return re.sub(r"(height: |drop: )([0-9.]+) mm", higher, text)


def from_board(text: str) -> str:
    gentle = re.sub(r"incline: \[[^]]*\] ?(deg)?", "incline: [0 deg, 10 deg, 40 deg, 50 deg]", text)
    return f"{gentle}\ncontact: {{datum: board}}\n"


BOARD = reader.parse(from_board(raised(UNIFORM.text, 20.0)), "board")
BOARD_GRADED = reader.parse(
    from_board(raised(GRADED.text, 36.0)).replace("tilt: 21", "rod_length: 102 mm\n    tilt: 21"),
    "graded",
)


@pytest.mark.parametrize("incline", [0.0, 35.0, 70.0])
def test_a_touching_rod_has_one_point_on_the_board_and_none_below(incline):
    chain = UNIFORM.chains["A"]
    tilt, theta = np.radians(chain.tilt_deg), np.radians(incline)
    middle = np.array([0.0, 0.0, contact.touching_heights(chain, incline)[0]])
    along = np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    turn = np.linspace(0.0, 2.0 * np.pi, 20_001)
    across = np.cross(along, [0.0, 1.0, 0.0])
    circle = np.outer(np.cos(turn), [0.0, 1.0, 0.0]) + np.outer(np.sin(turn), across)
    ends = [
        middle + sign * chain.rod_length / 2.0 * along + chain.diameters[0] / 2.0 * circle
        for sign in (-1.0, 1.0)
    ]
    board = np.array([0.0, np.sin(theta), np.cos(theta)])
    lowest = min(float((points @ board).min()) for points in ends)
    assert lowest == pytest.approx(0.0, abs=1e-9)


def test_thick_rods_touch_higher_however_long_they_are():
    chain = replace(GRADED.chains["A"], rod_length=0.3)
    *lower, top = contact.touching_heights(chain, 40.0)
    higher = contact.higher_contacts(GRADED, 40.0, GRADED.chains["A"])
    assert higher == pytest.approx([*(height - top for height in lower), 0.0])


@pytest.mark.parametrize("incline", [10.0, 50.0])
def test_what_is_measured_is_the_same_from_board_and_from_contact(incline):
    """The very fall, with heights from either zero."""
    one = case(BOARD, incline=incline, seed=3)
    level = contact.contact_level(BOARD, incline, one.run.impact).value
    other = replace(one, protocol=reader.parse(raised(UNIFORM.text, 20.0 - 1e3 * level), "contact"))
    found, expected = one.analyze().quantities, other.analyze().quantities
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        assert found[name].value == pytest.approx(value.value, rel=1e-9, abs=1e-12)
        assert found[name].u == pytest.approx(value.u, rel=1e-6)
    model = {name: (one.value, one.u) for name, one in predicted_run(BOARD, one.run).items()}
    for name, value in predicted_run(other.protocol, one.run).items():
        assert model[name] == pytest.approx((value.value, value.u), rel=1e-9)


@pytest.mark.parametrize("key", ["rod_length", "diameter"])
def test_rods_of_unknown_shape_touch_nobody_knows_where(key):
    text = re.sub(rf"\n    {key}:.*", "", UNIFORM.text)
    problems = refused(InputError, "", reader.parse, from_board(text), "f").problems
    assert any(f"A.{key}" in str(problem) for problem in problems)


def test_a_gate_behind_a_resting_rod_is_refused():
    said = "a rod at rest on the surface would block the beam"
    refused(InputError, said, reader.parse, from_board(UNIFORM.text), "f")
