"""Report and page for onlookers in a real browser: axe, four widths, both schemes; what comes new.

Of `./run bench soaks`, for a browser is large; `test_board.py` holds what can be told without one.
"""

import asyncio
import json
import re
from contextlib import closing

import pytest

from rig.board.page import BoardPage
from rig.board.process import BoardProcess
from rig.cli import main
from rig.recorder.published import PublishedState
from tests.report.test_browser import browse
from tests.test_site_browser import AXE, MISSING, RUN_AXE, ask_browser
from tests.tui.lab import kept_session
from tests.waiting import PATIENCE_S

PAGES = ["board.html", "local.html", "report.html"]
DRAWN = """const page = (await visit("board.html")).contentDocument;
const rods = page.querySelectorAll(".accent, .primary, .secondary").length;
tell([rods, page.querySelector("text.apart").textContent]);"""
pytestmark = [pytest.mark.slow, pytest.mark.skipif(MISSING, reason="chromium or axe is missing")]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return kept_session(tmp_path_factory.mktemp("recorded"))


@pytest.fixture(scope="module")
def built(session, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    for name, address in (("board", "http://192.0.2.7:8080/"), ("local", "http://localhost:80/")):
        page = BoardPage(address)
        page.look({"session": str(session)})
        (folder / f"{name}.html").write_text(page.look({"session": str(session)}), "utf-8")
    report = folder / "report.html"
    assert main(["report", str(session), "-o", str(report)]) == 0
    report.write_text(re.sub("<meta http-equiv=[^>]*>", "", report.read_text("utf-8")), "utf-8")
    return folder


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("width", [390, 820, 1400, 1920])
def test_axe_finds_nothing_and_nothing_is_too_wide(built, tmp_path, width, number):
    flag = f"--blink-settings=preferredColorScheme={number}"
    work = RUN_AXE.replace("SOURCE", AXE.as_uri()).replace("PAGES", json.dumps(PAGES))
    findings = ask_browser(built, tmp_path, work, flag, width=width)
    assert findings == {page: [[], False, None, True] for page in PAGES}


def test_who_asks_for_less_motion_sees_how_it_ended(built, tmp_path):
    rods, apart = ask_browser(built, tmp_path, DRAWN, "--force-prefers-reduced-motion")
    assert (rods, apart) == (4 * 25, "Δz 4.3 cm")


def test_what_is_new_comes_by_itself_under_the_servers_policy(session, tmp_path):
    async def look(board):
        state, page = PublishedState(), ""
        telling = asyncio.create_task(board.follow(state))
        while "wins by" not in page:  # virtual time may be over before the session is read
            state.set(session={"path": str(session)})
            page = await asyncio.to_thread(
                browse, tmp_path, "--virtual-time-budget=60000", "--dump-dom", board.address
            )
        telling.cancel()
        return page

    with closing(BoardProcess("localhost", 0)) as board:
        page = asyncio.run(asyncio.wait_for(look(board), PATIENCE_S))
    assert 'class="primary"' in page
