"""What stands on the screens, at three sizes, against text files; and the pictures of them.

``GOLDENS=write ./run test tests/tui/test_looks.py`` writes the files anew; look at the difference.
"""

import asyncio
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

from bench import pictures
from bench.pictures import QUIET, SIZES, FakeClient, at_rest, draw, screenshots, seen
from rig.results.live import LiveAnalysis
from rig.session.store import Session
from rig.tui.app import THEMES, RigApp
from rig.tui.context import Options
from rig.tui.state import state_of
from tests.cli.lab import short
from tests.tables import read_table
from tests.tui.lab import KEYS, colours_of, draw_without_pause, flow_of, kept_session, text_of

THEME_NAMES = [theme.name for theme in THEMES]
GOLDENS = Path(__file__).parent / "goldens"
MOMENTS = read_table(__file__, "moments")["looks"]


@pytest.fixture
def looks(tmp_path, monkeypatch):
    """Make a session to look at, with figures that are drawn without a pause."""
    draw_without_pause(monkeypatch)
    path = tmp_path / "looks.session"
    Session.create(path, short(), "looks.yaml", simulated=True, origin="sim://").close()
    return path


@pytest.mark.parametrize("moment", ["trouble", "help", "note"])
def test_a_screen_looks_as_it_did(moment, looks):
    # Help is broken into lines when it is opened.
    screens = [[size] for size in SIZES] if moment == "help" else [SIZES]
    texts = [
        text
        for sizes in screens
        for text in asyncio.run(_screens(moment, sizes, looks, lambda app: [text_of(app)]))
    ]
    for (columns, lines), text in zip(SIZES, texts, strict=True):
        compare(f"{moment}-{columns}x{lines}", text)


def compare(name, text):
    golden = GOLDENS / f"{name}.txt"
    if os.environ.get("GOLDENS") == "write":
        golden.write_text(text + "\n", "utf-8")
    assert text + "\n" == golden.read_text("utf-8"), golden.name


READABLE = 4.5
"""Contrast that WCAG 2.1 asks of text (1.4.3); of large text and of marks in figures it asks 3."""


def luminance(colour) -> float:
    """Relative luminance of an sRGB colour (WCAG 2.1)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
              for c in (one / 255 for one in colour)]  # fmt: skip
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("moment", ["device", "run", "trouble", "session"])
def test_all_text_can_be_read_in_every_theme(moment, looks):
    found = asyncio.run(_screens(moment, SIZES[1:2], looks, colours_of, THEME_NAMES))
    assert len(found) > 20 * len(THEME_NAMES)
    for text, ink, paper in found:
        if not any(map(str.isalnum, text)):
            continue  # lines and marks
        dark, bright = sorted((luminance(ink), luminance(paper)))
        assert (bright + 0.05) / (dark + 0.05) >= READABLE, (text, ink, paper)


async def _screens(moment, sizes, path, look, themes=THEME_NAMES[:1]):
    """Look at a moment in each size and theme; everything that was seen."""
    row, more = MOMENTS[moment]
    whole = state_of(LiveAnalysis(path).read())
    state = replace(whole, sections={**QUIET, **more, "session": whole.sections["session"]})
    app = RigApp(Options(session=path), KEYS, FakeClient(state))
    app.model.flow = flow_of(**row)
    found = []
    async with app.run_test(size=sizes[0]) as pilot:
        while app.model.view is None or not app.model.indicators.known:
            await pilot.pause()
        if moment == "help":
            await pilot.press("question_mark")
        if moment == "note":
            await pilot.press("n", *"warm")
        for size in sizes:
            await pilot.resize_terminal(*size)
            for theme in themes:
                app.theme = theme
                await at_rest(app, pilot, lambda: text_of(app))
                found += look(app)
    return found


PAGES = ["protocol", "device", "run", "live", "result", "session", "history"]


@pytest.fixture
def recorded(tmp_path, monkeypatch):
    """A session and its protocol in the working folder, so that no screen shows another's name."""
    monkeypatch.chdir(tmp_path)
    draw_without_pause(monkeypatch)
    protocol = Path("looks.yaml")
    protocol.write_text(short(), "utf-8")
    return kept_session(Path()), (protocol,)


def test_all_pages_look_as_they_did(recorded):
    session, files = recorded
    found = list(seen(session, KEYS, files, SIZES, ["dark"], text_of))
    assert [name for name, size, *_ in found if size == SIZES[0]] == PAGES
    for name, (columns, lines), _, text in found:
        compare(f"page-{name}-{columns}x{lines}", text)


def test_pictures_say_that_they_are_simulated_and_need_no_server(recorded, tmp_path, monkeypatch):
    """The first page has no session, and the last has: words of all are compared above."""
    session, files = recorded
    monkeypatch.setattr(pictures, "screenshots", lambda view: screenshots(view)[::6])
    for path in draw(session, tmp_path / "drawn", KEYS, files, [(80, 24)], ["light"]):
        text = path.read_text("utf-8")
        assert "SIMULATED" in text or path.name.startswith("protocol"), path.name
        assert not re.search(r"url\(['\"]?http", text)
