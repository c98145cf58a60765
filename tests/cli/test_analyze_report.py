"""``rig analyze``, its budget, and ``rig report`` of a session on the disk."""

import re
from unittest.mock import Mock

import pytest

from rig.session.store import Session
from tests.cli.lab import rig
from tests.tables import cases

pytestmark = pytest.mark.usefixtures("analysed_once")


@pytest.fixture(scope="module")
def page(finished, tmp_path_factory):
    """Return what ``rig report`` writes of the finished session."""
    path = tmp_path_factory.mktemp("alone") / "report.html"
    assert rig("report", finished.session, "-o", path) == (0, "", f"report: {path}\n")
    return path


@cases
def test_the_report_has_the_stamp_all_figures_and_every_run(texts, page, finished):
    assert [path.name for path in page.parent.iterdir()] == ["report.html"]
    html = page.read_text("utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert [text for text in texts if text not in html] == []
    figures = re.findall(r'<svg class="slim".*?</svg>', html, re.DOTALL)
    assert len(figures) == 5  # the result, the fall twice, the budget, the runs
    assert all("SIMULATED" in figure for figure in figures)
    assert html.count('<figure class="drop"') == 4  # what the gates saw of each drop
    assert len(html) < 400_000
    with Session.open(finished.session, readonly=True) as session:
        assert session.meta["protocol_sha256"] in html
    assert str(finished.session.parent) not in html, "no paths of the machine"


def test_the_same_session_gives_the_same_page(call, finished, page, tmp_path):
    call("report", finished.session, "-o", tmp_path / "r.html")
    assert (tmp_path / "r.html").read_bytes() == page.read_bytes()


def test_a_report_can_be_written_of_a_session_without_a_drop(call, tmp_path, protocol):
    session = tmp_path / "s"
    text = protocol.read_text("utf-8")
    Session.create(session, text, protocol.name, simulated=False, origin="/dev/ttyACM0").close()
    done = call("analyze", session, "--json")
    assert (done.json["runs"], done.json["summary"]) == ([], [])
    call("report", session, "-o", tmp_path / "r.html")
    html = (tmp_path / "r.html").read_text("utf-8")
    assert "No accepted runs" in html
    assert "SIMULATED" not in html
    call("export", session, "--csv", tmp_path / "csv")
    assert (tmp_path / "csv" / "edges.csv").read_text("utf-8") == "run,channel,time_s,state\n"
    call("replay", session)


@cases
def test_what_cannot_be_written_is_not_begun(
    call, finished, tmp_path, monkeypatch, command, work, place
):
    monkeypatch.setattr(f"rig.commands.{work}", Mock(side_effect=AssertionError))
    (tmp_path / "file").touch()
    words = [finished.session if word == "SESSION" else word for word in command]
    done = call(*words, tmp_path / place, code=2)
    assert done.err.startswith("cannot ")
    assert str(tmp_path / place) in done.err
    assert [one.name for one in tmp_path.iterdir()] == ["file"]


def test_a_budget_is_written_in_symbols_and_fits_a_terminal(call, finished):
    table = call("analyze", finished.session, "--budget", 1, "--trials", 2).out
    assert re.match("SIMULATED DATA\n(?s:.*)beam heights", table)
    assert re.search(r"^Δz = [0-9.]+ ± [0-9.]+ cm", table, re.MULTILINE)
    assert "by itself u" in call("analyze", finished.session, "--budget", 1).out
    assert "_m" not in table  # symbols, not names of JSON members
    assert max(map(len, table.splitlines())) <= 80
