"""Where emitters and receivers go."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from rig.protocol.reader import parse, read
from rig.report.canvas import figure_file
from rig.report.mounting import beam_ends, mounting_figure

PROTOCOLS = Path(__file__).parents[2] / "protocols"
READY = [
    path
    for path in sorted(PROTOCOLS.glob("*.yaml"))
    if "\ngates:" in path.read_text("utf-8") and "uno" not in path.stem  # as its like, with fewer
]


def drawn(protocol):
    return figure_file(mounting_figure(protocol, protocol.gates), "svg").decode()


@pytest.mark.parametrize("path", READY, ids=lambda path: path.stem)
def test_each_ready_protocol_has_its_drawing(path):
    protocol = read(path)
    said = "".join(ET.fromstring(drawn(protocol)).itertext()).split("\n")
    said = [words.strip() for words in said]
    for gate in protocol.gates.gates:
        assert f"{gate.channel}: {1e3 * gate.height:g}" in said
    inclines = {incline for incline in protocol.plan.inclines if protocol.surface is not None}
    assert {f"{incline:g}°" for incline in inclines} <= set(said)


def test_a_beam_ends_where_the_face_is_that_a_rod_lies_on():
    protocol = read(PROTOCOLS / "single-chain.yaml")
    slope, radius = math.radians(40), 12.7e-3 / 2
    uphill, along = beam_ends(protocol, 22e-3, 40)
    # The face is the line at a rod's radius from the contact point.
    assert -uphill * math.sin(slope) + 22e-3 * math.cos(slope) == pytest.approx(-radius, abs=1e-12)
    assert along * math.cos(slope) == pytest.approx(uphill)
    assert beam_ends(protocol, 22e-3, 80)[0] < uphill


def test_from_the_board_heights_are_those_above_its_face():
    text = (PROTOCOLS / "single-chain.yaml").read_text("utf-8").replace("22 mm", "40 mm")
    protocol = parse(f"{text}\ncontact: {{datum: board}}\n")
    uphill, _ = beam_ends(protocol, 40e-3, 40)
    assert uphill == pytest.approx(40e-3 / math.tan(math.radians(40)))
    svg = drawn(protocol)
    assert "mm above the board" in svg
    assert "contact point" not in svg
