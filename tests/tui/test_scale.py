"""Both chains to scale: where rods, gates and Δz stand, and on which dots."""

from dataclasses import replace

import pytest

from rig.protocol import reader
from rig.protocol.plan import runs
from rig.tui.indicators import Indicators
from rig.tui.motion import motions
from rig.tui.scale import Drawing, Lamp, Stroke, drawing, paint
from rig.units import Quantity
from tests.cli.lab import short
from tests.tui.test_motion import edges_of, recorded


def test_both_chains_stand_where_they_were_measured_and_the_bracket_is_their_difference():
    scene = reader.parse(short())
    run = runs(scene)[0]
    pairs = edges_of(scene, run)
    falls = motions(scene, run, recorded(run, pairs))
    time_s = float(falls[0].times[-1])
    lit = Indicators.of((0, 8)).seen(1 << 8, 0.0)
    found = drawing(scene, run, falls, lit, time_s)
    last = min(float(fall.times[-1]) for fall in falls)
    low, high = (fall.measured_height(last) + fall.length for fall in falls)
    assert found.apart_m == pytest.approx(high - low, abs=1e-9)
    assert found.apart_m == pytest.approx(0.1155, abs=0.02)
    by_color = {one.color: [] for one in found.strokes}
    for one in found.strokes:
        by_color[one.color].append(one)
    for color, chain in (("primary", run.impact), ("secondary", run.free)):
        assert len(by_color[color]) == scene.chains[chain].chain.rods
        assert all(one.x < one.to_x for one in by_color[color])
    assert len(by_color["accent"]) == 2 * len(by_color["primary"])  # the model of both, beside
    assert min(0.5 * (one.z + one.to_z) for one in by_color["primary"]) == 0.0  # on the board
    (gate,) = by_color["warning"]
    assert gate.z == next(one.height for one in scene.gates.gates if one.channel == 8)
    bracket = by_color["success"][0]
    assert bracket.to_z - bracket.z == pytest.approx(found.apart_m)
    assert drawing(scene, run, falls, lit, 0.0).apart_m is None


def test_from_the_board_rods_lie_where_they_touch_it():
    """The same fall with heights counted from 8 mm below the contact point is the same picture."""
    scene, level = reader.parse(short()), 0.008
    gates = tuple(replace(one, height=one.height + level) for one in scene.gates.gates)
    higher = replace(
        scene,
        drop=Quantity(scene.drop.value + level, scene.drop.u),
        gates=replace(scene.gates, gates=gates),
        contact=replace(scene.contact, level=Quantity(level, 0.001)),
    )
    run = runs(scene)[0]
    pairs = edges_of(scene, run)
    pictures = []
    for one in (scene, higher):
        falls = motions(one, run, recorded(run, pairs))
        lit = Indicators.of((0, 8))
        shown = drawing(one, run, falls, lit, float(falls[0].times[-1]))
        pictures.append([(s.z, s.to_z) for s in shown.strokes] + [(shown.apart_m, shown.top_m)])
    assert len(pictures[0]) == len(pictures[1])
    for one, other in zip(*pictures, strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_a_lit_lamp_names_its_channels():
    box = Stroke(0, 0, 1, 1, "primary")
    lamps = (Lamp(3, 0.9, 0.5, lit=True), Lamp(12, 0.9, 0.5, lit=False))
    text = ["".join(span.text for span in row)
            for row in paint(Drawing((box,), 1.0, 0.0, 1.0, None, lamps), 12, 5)]  # fmt: skip
    assert any("3,12●" in row for row in text)
    assert {len(row) for row in text[:-1]} == {12}


def test_a_dot_is_as_high_as_it_is_wide_and_all_dots_are_used():
    box = [Stroke(0, 0, 1, 0, "primary"), Stroke(1, 0, 1, 1, "primary"),
           Stroke(0, 1, 1, 1, "primary"), Stroke(0, 0, 0, 1, "primary")]  # fmt: skip
    *lines, words = [
        "".join(span.text for span in row)
        for row in paint(Drawing(tuple(box), 1.0, 0.0, 1.0, 0.123), 6, 4)
    ]
    assert lines == ["⡏⠉⠉⠉⠉⢹", "⡇    ⢸", "⣇⣀⣀⣀⣀⣸"]
    assert "Δz 12.3 cm" in words
