"""The Python door: what its notebook says, that it says what commands say, tables for notebooks."""

import json
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import rig
from rig.bundle.tables import column_unit
from rig.errors import InputError, SessionError
from rig.threads import libraries, one_thread
from tests.cli.lab import PROTOCOLS, ROOT, record
from tests.refusals import refused
from tests.tables import read_csv
from tests.waiting import PATIENCE_S

DOCS = ROOT / "docs"


@pytest.fixture
def here(finished, tmp_path, monkeypatch):
    """A folder as the page supposes it: with a session and its protocol."""
    finished.copy(tmp_path).rename(tmp_path / "my.session")
    (tmp_path / "my-chains.yaml").write_text(finished.protocol.read_text("utf-8"), "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("here")
def test_the_notebook_runs(monkeypatch, capsys):
    monkeypatch.setenv("MPLBACKEND", "agg")
    cells = json.loads((DOCS / "notebook.ipynb").read_text("utf-8"))["cells"]
    assert all(not cell.get("outputs") for cell in cells)
    exec("\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code"), {})
    assert "SIMULATED DATA" in capsys.readouterr().out


def test_it_says_what_the_command_says(here, call):
    said = call("analyze", here / "my.session", "--json").json
    with rig.open("my.session") as session:
        found = session.analyze()
        assert session.simulated
        assert session.protocol.title == "A short campaign"
    assert json.loads(json.dumps(found.json())) == said
    for run, line in zip(found.runs, said["runs"], strict=True):
        assert run.separation.json() == line["separation_m"]
        assert run.separation_raw.json() == line["separation_raw_m"]
        assert run.speed.json() == line["speed_m_s"]
        assert run.release_skew.json() == line["release_skew_s"]
        assert run.fall_time.json() == line["fall_time_s"]
        assert (run.run, run.verdict) == (line["run"], line["verdict"])
    for mean, line in zip(found.summary, said["summary"], strict=True):
        assert mean.speed.json() == line["speed_m_s"]
        assert mean.predicted["speed_m_s"].value == line["predicted"]["speed_m_s"]
    assert str(found).removeprefix("SIMULATED DATA\n") in call("analyze", "my.session").out
    assert repr(found) == "<results of 4 runs, 4 of them good, simulated>"
    written = repr(found.runs[0])
    assert re.fullmatch(r"<run 1 at 40°, A strikes, accepted: Δz .* ± .* cm, .*>", written)
    refused(InputError, "has no g", getattr, found.runs[0], "gravity")


@pytest.mark.usefixtures("here")
def test_edges_are_those_that_export_writes(call, tmp_path):
    call("export", "my.session", "--csv", tmp_path / "csv")
    table = np.loadtxt(tmp_path / "csv" / "edges.csv", delimiter=",", skiprows=1)
    session = rig.open("my.session")
    for run in (1, 4):
        edges = session.edges(run)
        mine = table[table[:, 0] == run]
        np.testing.assert_array_equal(edges.channel, mine[:, 1])
        np.testing.assert_array_equal(edges.blocked, mine[:, 3] == 1)
        np.testing.assert_allclose(edges.time_s, mine[:, 2], rtol=0, atol=2e-12)
    refused(InputError, r"run 99 has no recorded drop\n.*runs 1–4", session.edges, 99)
    assert repr(session) == "<session my.session: 4 runs, simulated>"


def test_what_is_not_there_is_said(tmp_path):
    refused(SessionError, "no session", rig.open, tmp_path / "none.session")
    refused(AttributeError, "it offers", getattr, rig, "opne")
    refused(InputError, "", rig.read_protocol, tmp_path / "none.yaml")


def threads():
    """How many each library uses that multiplies numpy's matrices."""
    ours = {one["filepath"] for one in libraries().info() if one["user_api"] == "blas"}
    assert ours  # numpy has one
    return {one["num_threads"] for one in threadpool_info() if one["filepath"] in ours}


def test_matrices_keep_to_one_thread_for_as_long_as_a_call_lasts():
    with threadpool_limits(2, user_api="blas"):
        assert one_thread(threads)() == {1}
        assert threads() == {2}


def test_who_is_done_leaves_the_others_their_one_thread():
    first_is_at_it, first_is_done, second_is_at_it = Event(), Event(), Event()

    @one_thread
    def first():
        first_is_at_it.set()
        assert second_is_at_it.wait(PATIENCE_S)

    @one_thread
    def second():
        second_is_at_it.set()
        assert first_is_done.wait(PATIENCE_S)
        return threads()

    with threadpool_limits(2, user_api="blas"), ThreadPoolExecutor(2) as pool:
        leaving = pool.submit(first)
        assert first_is_at_it.wait(PATIENCE_S)
        staying = pool.submit(second)
        leaving.result()
        first_is_done.set()
        assert staying.result() == {1}
        assert threads() == {2}


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
