"""Pictures of all pages, from a recorded session: in words against text files, and as SVG.

``looks.session.xz`` is what ``rig run`` recorded of `tests.cli.lab.short` at ``sim://?seed=4``;
``GOLDENS=write ./run test tests/tui`` writes the files anew; look at the difference.
"""

import lzma
import os
import re
from pathlib import Path

import pytest

from bench import pictures
from bench.pictures import SIZES, draw, screenshots, seen
from tests.cli.lab import short
from tests.tui.lab import KEYS, draw_without_pause
from tests.tui.screen import text_of
from tests.tui.test_looks import GOLDENS

RECORDED = Path(__file__).with_name("looks.session.xz")
PAGES = ["protocol", "device", "run", "live", "result", "session", "history"]


@pytest.fixture
def recorded(tmp_path, monkeypatch):
    """A session and its protocol in the working folder, so that no screen shows another's name."""
    monkeypatch.chdir(tmp_path)
    draw_without_pause(monkeypatch)
    protocol, session = Path("looks.yaml"), Path("looks.session")
    protocol.write_text(short(), "utf-8")
    session.write_bytes(lzma.decompress(RECORDED.read_bytes()))
    return session, (protocol,)


def test_all_pages_look_as_they_did(recorded):
    session, files = recorded
    found = list(seen(session, KEYS, files, SIZES, ["dark"], text_of))
    assert [name for name, size, *_ in found if size == SIZES[0]] == PAGES
    for name, (columns, lines), _, text in found:
        golden = GOLDENS / f"page-{name}-{columns}x{lines}.txt"
        if os.environ.get("GOLDENS") == "write":
            golden.write_text(text + "\n", "utf-8")
        assert text + "\n" == golden.read_text("utf-8"), golden.name


def test_pictures_say_that_they_are_simulated_and_need_no_server(recorded, tmp_path, monkeypatch):
    """The first page has no session, and the last has: words of all are compared above."""
    session, files = recorded
    monkeypatch.setattr(pictures, "screenshots", lambda view: screenshots(view)[::6])
    for path in draw(session, tmp_path / "drawn", KEYS, files, [(80, 24)], ["light"]):
        text = path.read_text("utf-8")
        assert "SIMULATED" in text or path.name.startswith("protocol"), path.name
        assert not re.search(r"url\(['\"]?http", text)
