"""A blind session keeps its numbers back from every command, until it is unblinded, once."""

import base64
import io
import re
import zipfile

import pytest

import rig as door
from rig.board.page import BoardPage
from rig.measurands import MEASURANDS
from rig.protocol.describe import describe
from rig.protocol.reader import read
from tests.cli.lab import short
from tests.tables import read_table


def unpacked(path):
    """All bytes of a file, and of what a page carries inside itself."""
    data = path.read_bytes()
    for packed in re.findall(rb"base64,([\w+/=]+)", data):
        inside = base64.b64decode(packed)
        data += inside
        if zipfile.is_zipfile(io.BytesIO(inside)):
            with zipfile.ZipFile(io.BytesIO(inside)) as archive:
                # Edges are what is measured from, and are no results.
                results = [name for name in archive.namelist() if name != "edges.csv"]
                data += b"".join(map(archive.read, results))
    return data.replace("−".encode(), b"-")


def digits(found):
    """Write six digits of every measurand, in each of its units, rounded or cut off."""
    numbers = {
        (row, record[row.name]["value"])
        for record in found["runs"] + found["summary"]
        for row in MEASURANDS.values()
        if row.name in record and row.name != "release_skew_s"
    }
    return {
        text.encode()
        for row, value in numbers
        for scale in (1.0, row.scale, row.fine_scale)
        for text in (f"{value * scale:#.6g}", f"{value * scale:#.17g}"[:8])
    }


def assert_silent(who, said):
    assert [word for word in read_table(__file__, "blind")[who] if word in said] == []


@pytest.mark.usefixtures("analysed_once")
def test_what_was_measured_is_kept_back_until_the_session_is_unblinded(call, tmp_path, monkeypatch):
    monkeypatch.setattr("rig.report.canvas.KINDS", ("svg",))  # the others are packed
    protocol, session, page = (tmp_path / name for name in ("b.yaml", "b.session", "b.html"))
    protocol.write_text(short("[40 deg]", 4) + "\nblind: true\n", "utf-8")
    assert "blind" in describe(read(protocol))
    ran = call("run", protocol, "--port", "sim://?seed=5", "--session", session, "--yes")
    assert "skew" in ran.err
    for said in (ran.out, ran.err, call("analyze", session).out):
        assert_silent("commands", said)
    found = call("analyze", session, "--json").json
    assert found["blind"] is True
    assert found["summary"] == []
    for run in found["runs"]:
        assert run["verdict"] == "accepted"
        assert_silent("json", run)
        assert "release_skew_s" in run
    assert not door.open(session).analyze().runs[0].quantities.keys() - {"release_skew_s"}
    drawn = tmp_path / "drawn"
    call("report", session, "-o", page, "--figures", drawn)
    hidden_from = [unpacked(path) for path in (page, *drawn.iterdir())]
    assert len(hidden_from) == 3, "a page, a figure and its table"
    html = page.read_text("utf-8")
    assert "hidden until <code>rig unblind</code>" in html
    assert_silent("report", html)
    board, news = BoardPage("http://localhost:8080/"), {"session": str(session)}
    board.look(news)
    shown = board.look(news).partition("<script>")[0]
    assert "hidden until <code>rig unblind</code>" in shown
    assert_silent("board", shown)
    for refused in (("estimate", session), ("analyze", session, "--budget", "1")):
        assert "is blind" in call(*refused, code=2).err
    call("unblind", session)
    assert " wins by " in board.look(news)
    assert "is open since" in call("unblind", session, code=2).err
    after = call("analyze", session, "--json").json
    assert "blind" not in after
    assert all("separation_m" in run for run in after["runs"])
    call("replay", session)
    secret = digits(after)
    assert len(secret) > 20
    assert not [number for number in secret for data in hidden_from if number in data]
    monkeypatch.setattr("rig.report.plot.page_svg", lambda *_: "")  # its tables say enough
    call("report", session, "-o", page)
    assert len([number for number in secret if number in unpacked(page)]) > 10, (
        "else none is looked for"
    )
