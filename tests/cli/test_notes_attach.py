"""Notes and files are added to a finished session, and nothing in it is altered."""

from __future__ import annotations

import json
import shutil

import pytest

from rig.bundle.archive import read_bundle
from rig.session.store import Session
from tests.cli.lab import log_of


@pytest.fixture
def session(fences, tmp_path):
    return shutil.copy(fences, tmp_path / "copy.session")


@pytest.mark.usefixtures("analysed_once")
def test_notes_and_files_travel_in_report_and_bundle(session, call, tmp_path):
    photo, page, bundle = (tmp_path / name for name in ("a photo.jpg", "page.html", "b.eln"))
    photo.write_bytes(bytes(range(256)))
    before = json.loads(call("analyze", session, "--json").out)
    states = log_of(session)
    with Session.open(session, readonly=True) as opened:
        drops = [*opened.drops()]
    for text in ("a draught", "the door was open"):
        done = call("notes", session, "--run", 3, text)
        assert (done.code, f"run 3, attempt 1: {text}" in done.out) == (0, True)
    assert call("attach", session, photo).code == 0
    with Session.open(session, readonly=True) as opened:
        assert [*opened.drops()] == drops
        assert opened.chain().faults == []
        assert opened.attachments()[0].data == photo.read_bytes()
    after = log_of(session)
    for run, entries in states.items():
        assert after[run][: len(entries)] == entries, "nothing was altered"
        assert {entry[1] for entry in after[run][len(entries) - 1 :]} == {entries[-1][1]}
    again = json.loads(call("analyze", session, "--json").out)
    assert again["summary"] == before["summary"]
    assert call("report", session, "-o", page).code == 0
    text = page.read_text("utf-8")
    assert "a draught · the door was open" in text
    assert "Attached: a photo.jpg" in text
    assert 'download="a photo.jpg"' in text
    assert call("export", session, "--bundle", bundle).code == 0
    files = read_bundle(bundle).files
    assert files["experiment/attached/1-a_photo.jpg"] == photo.read_bytes()
    assert b"a draught" in files["experiment/tables/states.csv"]
    done = call("verify", bundle)
    assert (done.code, "a photo.jpg, 256 bytes" in done.out) == (0, True), done.out


def test_what_cannot_be_noted_or_attached_is_refused_in_words(session, call, tmp_path):
    data = session.read_bytes()
    done = call("notes", session, "--run", 99, "text")
    assert (done.code, "run 99 has no recorded drop" in done.err) == (2, True)
    empty = tmp_path / "empty"
    empty.touch()
    for file, said in ((tmp_path, "it is a folder"), (empty, "no bytes"), ("/absent", "No such")):
        done = call("attach", session, file)
        assert (done.code, said in done.err, str(file) in done.err) == (2, True, True), done
    with Session.open(session, readonly=True) as opened:
        assert opened.attachments() == []
    assert session.read_bytes() == data
