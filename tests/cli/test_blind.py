"""A blind session keeps its numbers back from every command, until it is unblinded, once."""

from __future__ import annotations

import json

import rig as door
from rig.session.store import Session
from tests.cli.lab import rig, short


def test_what_was_measured_is_kept_back_until_the_session_is_unblinded(tmp_path):
    protocol, session, page = (tmp_path / name for name in ("b.yaml", "b.session", "b.html"))
    protocol.write_text(short("[40 deg]", 4) + "\nblind: true\n", "utf-8")
    assert "blind" in rig("check", protocol).stdout
    ran = rig("run", protocol, "--port", "sim://?seed=5", "--session", session, "--yes")
    assert ran.returncode == 0, ran.stderr
    assert "skew" in ran.stderr
    for said in (ran.stdout, ran.stderr, rig("analyze", session).stdout):
        assert "V " not in said
        assert "Δz" not in said
        assert "No accepted runs" not in said, "there are four, only kept back"
        assert "No mean" not in said
    found = json.loads(rig("analyze", session, "--json").stdout)
    assert found["blind"] is True
    assert found["summary"] == []
    for run in found["runs"]:
        assert run["verdict"] == "accepted"
        assert "separation_m" not in run
        assert "speed_m_s" not in run
        assert "last_passages" not in run
        assert "release_skew_s" in run
    assert not door.open(session).analyze().runs[0].quantities.keys() - {"release_skew_s"}
    report = rig("report", session, "-o", page)
    assert report.returncode == 0, report.stderr
    assert "No accepted runs" not in page.read_text("utf-8")
    for refused in (("estimate", session), ("analyze", session, "--budget", "1")):
        done = rig(*refused)
        assert done.returncode != 0
        assert "is blind" in done.stderr
    with Session.open(session, readonly=True) as opened:
        assert opened.results()
        assert not opened.beside_results(door.__version__), "where chains fell tells all"
    first = rig("unblind", session)
    assert first.returncode == 0, first.stderr
    again = rig("unblind", session)
    assert (again.returncode, "is open since" in again.stderr) == (2, True)
    after = json.loads(rig("analyze", session, "--json").stdout)
    assert "blind" not in after
    assert all("separation_m" in run for run in after["runs"])
    with Session.open(session, readonly=True) as opened:
        assert len(opened.beside_results(door.__version__)) == 4
    assert rig("replay", session).returncode == 0
