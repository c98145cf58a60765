"""Both chains to scale: where rods, gates and Δz stand, and on which dots."""

from dataclasses import replace

import pytest

from rig.protocol import reader
from rig.protocol.plan import runs
from rig.tui.indicators import Indicators
from rig.tui.motion import motions, separation
from rig.tui.scale import Drawing, Stroke, drawing
from rig.tui.widgets.chains import painted
from rig.units import Quantity
from tests.cli.lab import short
from tests.report.test_figures import FILM
from tests.tui.test_motion import HZ, edges_of


def test_both_chains_stand_where_they_were_measured_and_the_bracket_is_their_difference():
    scene = reader.parse(short())
    run = runs(scene)[0]
    pairs = edges_of(scene, run)
    rods = {number: rod for number, (_, rod) in enumerate(pairs)}
    falls = motions(scene, run, [edge for edge, _ in pairs], HZ, rods)
    time_s = float(falls[0].times[-1])
    lit = Indicators.of((0, 8)).seen(1 << 8, 0.0)
    found = drawing(scene, run, falls, lit, time_s)
    gaps = separation(falls, time_s).gaps
    assert found.apart_m == pytest.approx(gaps[-1], abs=1e-6)
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
    rods = {number: rod for number, (_, rod) in enumerate(pairs)}
    pictures = []
    for one in (scene, higher):
        falls = motions(one, run, [edge for edge, _ in pairs], HZ, rods)
        lit = Indicators.of((0, 8))
        shown = drawing(one, run, falls, lit, float(falls[0].times[-1]))
        pictures.append([(s.z, s.to_z) for s in shown.strokes] + [(shown.apart_m, shown.top_m)])
    assert len(pictures[0]) == len(pictures[1])
    for one, other in zip(*pictures, strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_a_film_shows_each_rod_as_it_lies_and_the_strings_that_are_slack():
    scene = reader.parse(short())
    run = runs(scene)[0]
    falls = motions(scene, run, [edge for edge, _ in edges_of(scene, run)], HZ)
    time_s = float(falls[0].times[-1])
    plain = drawing(scene, run, falls, Indicators.of((0, 8)), time_s)
    shown = drawing(scene, run, falls, Indicators.of((0, 8)), time_s, FILM)
    rods = [one for one in shown.strokes if one.color == "primary"]
    middle = 0.5 * (rods[0].x + rods[0].to_x)
    ends = zip(FILM.left[-1], FILM.right[-1], strict=True)
    assert rods == [
        Stroke(middle + one[0], one[2], middle + other[0], other[2], "primary")
        for one, other in ends
    ]
    new = [one for one in shown.strokes if one not in plain.strokes and one not in rods]
    assert new == [Stroke(middle + 0.05, 0.08, middle + 0.05, 0.17, "foreground")]


def test_a_dot_is_as_high_as_it_is_wide_and_all_dots_are_used():
    box = [Stroke(0, 0, 1, 0, "primary"), Stroke(1, 0, 1, 1, "primary"),
           Stroke(0, 1, 1, 1, "primary"), Stroke(0, 0, 0, 1, "primary")]  # fmt: skip
    *lines, words, _ = [
        "".join(span.text for span in row)
        for row in painted(Drawing(tuple(box), 1.0, 0.0, 1.0, 0.123), 6, 5)
    ]
    assert lines == ["⡏⠉⠉⠉⠉⢹", "⡇    ⢸", "⣇⣀⣀⣀⣀⣸"]
    assert words.startswith("Δz 12.3 cm")
