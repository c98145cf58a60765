"""One table of measurands: a row and a function are all that a new one takes."""

from __future__ import annotations

import csv
import json

import pytest

from rig.analysis.quantities import COMPUTED
from rig.measurands import MEASURANDS, Measurand
from rig.tui.pictures import draw
from tests.tui.lab import KEYS

SPIN = Measurand(
    "free_arrival_m_s", "Vf", "free speed", "speed of the free chain",
    "speed of the free chain's top rod when the other one reaches the surface",
    "m/s", 1.0, 3, "mm/s", 1e3, 2, averaged=True, listed=True, told=True, by_chain=True,
)  # fmt: skip


@pytest.fixture
def added(monkeypatch):
    """Have a measurand that nobody has heard of: how fast the free chain is at the end."""

    def compute(drop):
        model, x = drop.model, drop.x
        if set(model.records) != {"impact", "free"}:
            return None
        struck, free = model.trajectory("impact", x), model.trajectory("free", x)
        since = float(struck.time[-1] - free.time[0])
        gravity = model.protocol.gravity.value
        gradient = gravity * model.spread("impact", struck.d_time[-1])
        gradient[model.unknowns["free release"]] -= gravity
        return gravity * since, gradient

    monkeypatch.setitem(MEASURANDS, SPIN.name, SPIN)
    monkeypatch.setitem(COMPUTED, SPIN.name, compute)


@pytest.mark.parametrize("name", MEASURANDS)
def test_every_row_is_computed_and_speaks_of_itself(name):
    row = MEASURANDS[name]
    assert name in COMPUTED
    assert name == row.name == row.stem + row.key("")[len(row.stem) + 1 :]
    assert row.key("sd").startswith(f"{row.stem}_sd_")
    assert row.symbol
    assert row.meaning
    assert row.unit


def test_keys_of_a_name_with_several_words():
    assert MEASURANDS["fall_time_s"].key("sd") == "fall_time_sd_s"
    assert MEASURANDS["fall_time_s"].stem == "fall_time"
    assert MEASURANDS["gravity_m_s2"].key("se") == "gravity_se_m_s2"
    assert MEASURANDS["separation_raw_m"].key("U95") == "separation_raw_U95_m"


@pytest.mark.usefixtures("added")
def test_a_new_measurand_appears_wherever_results_do(call, finished, tmp_path):
    session = finished.copy(tmp_path)
    found = json.loads(call("analyze", session, "--json").out)
    for run in found["runs"]:
        assert {"value", "u", "U95"} == set(run[SPIN.name])
        assert run[SPIN.name]["value"] == pytest.approx(
            9.81 * run["fall_time_s"]["value"], rel=0.02
        )
    line = found["summary"][0]
    assert {SPIN.name, "free_arrival_sd_m_s", "free_arrival_se_m_s"} <= set(line)
    assert line["normalized_error_free_arrival"] is None  # no model says what it should be
    assert "Vf ± U (m/s)" in call("analyze", session).out
    assert "Vf (mm/s)" in call("analyze", session, "--scatter").out
    assert call("export", session, "--csv", tmp_path / "csv").code == 0
    for table in ("runs", "summary"):
        with (tmp_path / "csv" / f"{table}.csv").open(newline="") as file:
            assert float(next(csv.DictReader(file))[SPIN.name]) > 4.0
    assert SPIN.meaning in (tmp_path / "csv" / "README.txt").read_text("utf-8")
    assert call("report", session, "-o", tmp_path / "r.html").code == 0
    page = (tmp_path / "r.html").read_text("utf-8")
    assert page.count("Vf ± U (m/s)") == 2  # the summary's table, and that of the runs
    assert "could not be made" not in page
    pictures = draw(session, tmp_path / "screens", KEYS, sizes=[(120, 36)], themes=["dark"])
    screens = {path.stem.partition("-")[0]: path for path in pictures}
    for screen, text in (("result", SPIN.label), ("session", SPIN.symbol)):
        drawn = screens[screen].read_text("utf-8").replace("&#160;", " ")
        assert text in drawn, screen
