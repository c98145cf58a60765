"""There is one predictor: tables, curves and the terminal say the same, with and without air."""

import json

import numpy as np
import pytest

from rig.analysis.curves import model_curves
from rig.measurands import MEASURANDS
from rig.predictions import predicted_run, predictions
from rig.protocol import reader
from rig.tui.motion import motions
from tests.cli.lab import PROTOCOLS, short
from tests.tables import protocol_text, read_table

AIR = "drag: {terminal_speed: 12 m/s ± 1 m/s}\n"
UNLIKE = (
    short().replace("B: {like: A}", "B: {like: A, length: 1200 mm}").replace("1078 mm", "1071 mm")
)
SCENES = {
    "uniform": short(),
    "in air": short() + AIR,
    "unlike": UNLIKE,
    "unlike, in air": UNLIKE + AIR,
    "single": (PROTOCOLS / "single-chain.yaml").read_text("utf-8"),
}
ON_BOARD = protocol_text("two-rods-on-board")


@pytest.mark.parametrize("name", SCENES)
def test_all_who_predict_say_the_same(name):
    scene = reader.parse(SCENES[name])
    curves = model_curves(scene)
    said = [one.json() for one in predictions(scene)]
    assert {line.get("impact_chain") for line in said} == (
        {"A", "B"} if name.startswith("unlike") else {None}
    )
    for line in said:
        struck = line.get("impact_chain", "A")
        run = next(
            one
            for one in scene.runs()
            if (one.incline_deg, one.impact) == (line["incline_deg"], struck)
        )
        expected = predicted_run(scene, run)
        assert ("separation_m" in expected) == scene.two_chains
        for row in (MEASURANDS[name] for name in expected):
            assert expected[row.name].value == line[row.name]
            assert expected[row.name].u == line.get(row.key("u"), expected[row.name].u)
        points = zip(curves["incline_deg"], curves["segments"], strict=True)
        (at,) = (
            n
            for n, (incline, segment) in enumerate(points)
            if incline == line["incline_deg"] and segment.partition("chain ")[2] in {"", struck}
        )
        assert curves["speed_m_s"][at] == line["speed_m_s"]
        if struck == "A":  # the picture's line is the first chain's
            assert curves["free_fall_speed_m_s"] == line["free_fall_speed_m_s"]
        both = motions(scene, run)
        assert both[0].model.time[-1] == pytest.approx(line["fall_time_s"], rel=1e-12)
        assert both[0].model.arrival == pytest.approx(line["speed_m_s"], rel=1e-12)
        if scene.two_chains:
            assert curves["separation_m"][at] == line["separation_m"]
            when, heights = both[0].curve(9.0)
            gaps = both[1].model.heights(when[-1:])[0] - heights[-1:]
            longer = np.subtract(*(scene.chains[one].chain.length for one in (run.free, struck)))
            assert gaps[-1] + longer == pytest.approx(line["separation_m"], rel=1e-9)


@pytest.mark.parametrize(("name", "numbers"), read_table(__file__, "predicted").items())
def test_what_is_predicted_are_these_numbers(name, numbers):
    """Of the scenes above and of ready protocols."""
    scene = reader.parse(SCENES[name]) if name in SCENES else reader.read(PROTOCOLS / name)
    said = json.dumps([one.json() for one in predictions(scene)])
    assert json.loads(said, parse_float=lambda number: float(f"{float(number):.9g}")) == numbers


@pytest.mark.parametrize("air", ["", AIR])
@pytest.mark.parametrize("length", ["600 mm", "15 mm"])
def test_a_rod_that_touches_before_the_release_is_a_note_at_its_incline(length, air):
    """A rod of 13 mm touches 8 mm above a board at 40°, and 37 mm at 80°."""
    low, steep = predictions(reader.parse(ON_BOARD.replace("LENGTH", length) + air))
    assert low.speed_m_s > 0.0
    assert steep.speed_m_s is None
    assert "before the release" in steep.notes[0]
