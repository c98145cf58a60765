"""Site, report and page for onlookers in a real browser, and the report on paper.

Of `./run bench soaks`, for a browser is large; what can be told without one is for `test_site.py`,
`report/test_page.py` and `cli/test_board.py`.
"""

import asyncio
import json
import os
import re
import shutil
from contextlib import closing
from html import unescape
from pathlib import Path

import pytest

from rig.board.page import BoardPage
from rig.board.process import BoardProcess
from rig.cli import main
from rig.recorder.published import PublishedState
from tests.programs import run_program
from tests.test_site import load
from tests.tui.lab import kept_session
from tests.waiting import PATIENCE_S

BROWSER = shutil.which("chromium")
AXE = Path(__file__).parent / "axe/node_modules/axe-core/axe.min.js"
MISSING = (BROWSER is None or not AXE.is_file()) and not os.environ.get("CI")
SCRIPTS = Path(__file__).with_name("browser")
ONES_OWN = dict.fromkeys(("report.html", "board.html", "local.html"))
"""Pages whose style sheets ask the browser for its scheme."""
AT_ONCE = 10  # pages a browser visits before it is started anew
_HOST, _AXE, _SEARCH = (
    (SCRIPTS / name).read_text("utf-8") for name in ("host.html", "axe.js", "search.js")
)
_LOOP = 'tell((await visit("docs/pictures/loop.svg")).contentDocument.getAnimations().length);'
_DRAWN = """const page = (await visit("board.html")).contentDocument;
const rods = page.querySelectorAll(".accent, .primary, .secondary").length;
tell([rods, page.querySelector("text.apart").textContent]);"""
_STILL = "--force-prefers-reduced-motion"
_QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-quic",
)  # fmt: skip
pytestmark = [pytest.mark.slow, pytest.mark.skipif(MISSING, reason="chromium or axe is missing")]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return kept_session(tmp_path_factory.mktemp("recorded"))


@pytest.fixture(scope="module")
def report(session):
    page = session.with_name("report.html")
    assert main(["report", str(session), "-o", str(page)]) == 0
    return page


@pytest.fixture(scope="module")
def built(session, report, tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    load("site").main(folder)
    # It lets no other script run, and folds what a referee wants.
    text = re.sub(r"<meta http-equiv=.Content-Security-Policy[^>]*>", "", report.read_text("utf-8"))
    (folder / report.name).write_text(text.replace("<details ", "<details open "), "utf-8")
    for name, address in (("board", "http://192.0.2.7:8080/"), ("local", "http://localhost:80/")):
        page = BoardPage(address)
        page.look({"session": str(session)})
        (folder / f"{name}.html").write_text(page.look({"session": str(session)}), "utf-8")
    return folder


def browse(folder: Path, *arguments: str) -> str:
    profile = f"--user-data-dir={folder / 'profile'}"
    return run_program(BROWSER, *_QUIET, profile, *arguments).stdout


def ask_browser(built, tmp_path, work, *flags, width=1400):
    """What a script of ours says that visits pages of the site."""
    host = _HOST.replace("WORK", work).replace("WIDTH", str(width))
    (built / "host.htm").write_text(host, "utf-8")
    written = browse(
        tmp_path, "--window-size=2000,1000", "--virtual-time-budget=900000", *flags,
        "--allow-file-access-from-files", "--dump-dom", (built / "host.htm").as_uri(),
    )  # fmt: skip
    return json.loads(unescape(re.search(r"<title>(.*?)</title>", written, re.DOTALL)[1]))


@pytest.mark.parametrize(("scheme", "number"), [("slate", 0), ("default", 1)])
@pytest.mark.parametrize("width", [390, 820, 1400, 1920])
def test_axe_finds_nothing_and_nothing_is_too_wide(built, tmp_path, width, scheme, number):
    pages = sorted(page.relative_to(built).as_posix() for page in built.rglob("*.html"))
    pages.remove("404.html")  # for servers: it looks for its style at their root
    assert len(pages) > 30
    flag = f"--blink-settings=preferredColorScheme={number}"
    findings = {}
    for begin in range(0, len(pages), AT_ONCE):
        work = _AXE.replace("PAGES", json.dumps(pages[begin : begin + AT_ONCE]))
        work = work.replace("SOURCE", AXE.as_uri())
        findings |= ask_browser(built, tmp_path, work, flag, width=width)
    schemes = dict.fromkeys(pages, scheme) | ONES_OWN
    assert findings == {page: [[], False, schemes[page], True] for page in pages}


def test_search_works_in_pages_that_are_opened_as_files(built, tmp_path):
    assert re.search(r"[1-9] matching documents", ask_browser(built, tmp_path, _SEARCH))


def test_what_moves_rests_for_whoever_asks_for_less_motion(built, tmp_path):
    assert ask_browser(built, tmp_path, _LOOP) > 20
    assert ask_browser(built, tmp_path, _LOOP, _STILL) == 0
    rods, apart = ask_browser(built, tmp_path, _DRAWN, _STILL)
    assert (rods, apart) == (4 * 25, "Δz 4.3 cm"), "how it ended"


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


def read_pages(paper: Path) -> list[str]:
    return run_program("pdftotext", paper, "-").stdout.split("\f")[:-1]


def test_print_has_no_empty_page(report, tmp_path):
    paper = tmp_path / "page.pdf"
    browse(tmp_path, f"--print-to-pdf={paper}", report.as_uri())
    pages = read_pages(paper)
    assert len(pages) > 2
    assert all(len(text.split()) > 10 for text in pages)
    assert "separation Δz (cm)" in pages[0], "the first figure is on the first page"
    appendix = next(n for n, text in enumerate(pages) if "Appendix: Every drop" in text)
    assert all("attempt" in text for text in pages[appendix:]), "each page of a table has its head"
    assert "data.zip" not in "".join(pages), "nothing is attached to what a browser prints"


def test_a_pdf_needs_no_browser(session, tmp_path):
    paper = tmp_path / "report.pdf"
    assert main(["report", str(session), "-o", str(tmp_path / "a.html"), "--pdf", str(paper)]) == 0
    pages = read_pages(paper)
    assert 2 < len(pages) <= 5
    assert "Figure 1." in pages[0]
    assert all(text.split()[-1] == str(number) for number, text in enumerate(pages, 1))
    assert "Choose" not in "".join(pages), "nobody can click on paper"
    listed = run_program("pdfdetach", "-list", paper)
    assert {"data.zip", "method.md"} <= set(listed.stdout.split())
