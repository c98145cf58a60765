"""One table of measurands: a row and a function are all that a new one takes."""

import csv

import pytest

from bench.pictures import seen
from rig.analysis.quantities import COMPUTED
from rig.measurands import MEASURANDS, Measurand
from rig.results.live import LiveAnalysis
from rig.tui.drop_words import number_table
from tests.tui.lab import KEYS, text_of, unseen

SIZE = [(120, 36)]

BLOW = Measurand(
    "free_blow_J", "Ef", "free energy", "energy of the free chain",
    "kinetic energy of a kilogram of the free chain when the other one reaches the surface",
    "averaged listed told by_chain", "kJ", 1e-3, 5, "J", 1.0, 3,
)  # fmt: skip


@pytest.fixture
def added(monkeypatch):
    """Have a measurand that nobody has heard of, in a unit that no other one has."""

    def compute(drop):
        if not drop.both:
            return None
        speed = drop.model.protocol.gravity.value * (drop.arrival.when - drop.release("free"))
        return 0.5 * speed * speed

    monkeypatch.setitem(MEASURANDS, BLOW.name, BLOW)
    monkeypatch.setitem(COMPUTED, BLOW.name, compute)


@pytest.mark.parametrize("name", MEASURANDS)
def test_every_row_is_computed_and_speaks_of_itself(name):
    row = MEASURANDS[name]
    assert name in COMPUTED
    assert name == row.name == row.stem + row.key("")[len(row.stem) + 1 :]
    assert row.key("sd").startswith(f"{row.stem}_sd_")
    assert row.symbol
    assert row.meaning
    assert row.unit


@pytest.mark.usefixtures("added", "analysed_once", "undrawn")
def test_a_new_measurand_appears_wherever_results_do(call, finished, tmp_path, monkeypatch):
    unseen(monkeypatch)
    session = finished.copy(tmp_path)
    found = call("analyze", session, "--json", "--fresh").json
    for run in found["runs"]:
        assert {"value", "u", "U95"} == set(run[BLOW.name])
        speed = 9.81 * run["fall_time_s"]["value"]
        assert run[BLOW.name]["value"] == pytest.approx(speed**2 / 2.0, rel=0.04)
    line = found["summary"][0]
    assert {BLOW.name, "free_blow_sd_J", "free_blow_se_J"} <= set(line)
    assert line["normalized_error_free_blow"] is None  # no model says what it should be
    assert "Ef ± U (kJ)" in call("analyze", session).out
    assert "Ef (J)" in call("analyze", session, "--scatter").out
    call("export", session, "--csv", tmp_path / "csv")
    for table in ("runs", "summary"):
        with (tmp_path / "csv" / f"{table}.csv").open(newline="") as file:
            assert float(next(csv.DictReader(file))[BLOW.name]) > 8.0
    assert BLOW.meaning in (tmp_path / "csv" / "README.txt").read_text("utf-8")
    call("report", session, "-o", tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text("utf-8")
    assert page.count("Ef ± U (kJ)") == 3  # means, their comparison, and the runs
    assert "could not be made" not in page
    screens = {name: text for name, *_, text in seen(session, KEYS, (), SIZE, ["dark"], text_of)}
    assert BLOW.symbol in screens["session"]
    view = LiveAnalysis(session).read()
    assert BLOW.symbol in number_table(view, view.jobs[-1])  # behind Tab on the result page
