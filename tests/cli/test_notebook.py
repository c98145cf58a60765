"""Tables and numbers for notebooks, of one session and of several."""

import sys

import pytest

import rig
from rig.bundle.tables import column_unit
from rig.errors import InputError
from tests.cli.lab import PROTOCOLS, record
from tests.refusals import refused
from tests.tables import read_csv

pytestmark = pytest.mark.usefixtures("analysed_once")


@pytest.fixture(scope="module")
def ball(analysed_once, tmp_path_factory):
    text = (PROTOCOLS / "falling-ball.yaml").read_text("utf-8").replace("repeats: 10", "repeats: 4")
    return record(tmp_path_factory.mktemp("ball"), text, "sim://?stated=1&seed=3")


@pytest.mark.parametrize("table", ["runs", "summary", "gates"])
def test_a_frame_has_the_columns_of_the_exported_file_and_their_units(table, ball, call, tmp_path):
    pytest.importorskip("pandas")
    call("export", ball, "--csv", tmp_path)
    rows = read_csv(tmp_path / f"{table}.csv")
    frame = rig.open(ball).analyze().to_frame(table)
    assert frame.attrs["simulated"] is True
    whole = frame.reset_index(drop=table != "runs")
    assert set(whole) == set(rows[0])
    for column, unit in frame.attrs["units"].items():
        assert unit == column_unit(column)
        values = [float(row[column]) for row in rows if row[column]]
        assert whole[column].dropna().tolist() == pytest.approx(values)
    assert "m/s²" in frame.attrs["units"].values() or table == "gates"


def test_a_value_is_a_number_with_its_uncertainty(ball):
    pytest.importorskip("uncertainties")
    gravity = rig.open(ball).analyze().summary[0].gravity
    twice = 2.0 * gravity.ufloat()
    assert (twice.nominal_value, twice.std_dev) == pytest.approx((2 * gravity.value, 2 * gravity.u))


def test_without_the_packages_it_says_which_ones(ball, monkeypatch):
    for package in ("pandas", "uncertainties"):
        monkeypatch.setitem(sys.modules, package, None)
    found = rig.open(ball).analyze()
    for ask, package in ((found.to_frame, "pandas"), (found.summary[0].gravity.ufloat, "unc")):
        (reason,) = refused(InputError, package, ask).reasons
        assert reason.code == "package_absent"


def test_a_notebook_shows_the_means(ball):
    shown = rig.open(ball).analyze()._repr_html_()
    assert "SIMULATED DATA" in shown
    assert "<table>" in shown
    assert "g ± U (m/s²)" in shown
