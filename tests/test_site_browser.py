"""Site and report in a real browser: axe finds nothing, at three widths, in both schemes.

Of `./run bench soaks`, for a browser is large; `test_site.py` holds what can be told without one.
"""

import json
import os
import re
from html import unescape
from pathlib import Path

import pytest

from rig.cli import main
from tests.report.test_browser import BROWSER, browse
from tests.test_site import load
from tests.tui.lab import kept_session

AXE = Path(__file__).parent / "axe/node_modules/axe-core/axe.min.js"
REPORT = "report.html"
SCRIPTS = Path(__file__).with_name("browser")
AT_ONCE = 10  # pages a browser visits before it is started anew
MISSING = (BROWSER is None or not AXE.is_file()) and not os.environ.get("CI")
_HOST = (SCRIPTS / "host.html").read_text("utf-8")
RUN_AXE = (SCRIPTS / "axe.js").read_text("utf-8")
_SEARCH = (SCRIPTS / "search.js").read_text("utf-8")
_LOOP = 'tell((await visit("docs/pictures/loop.svg")).contentDocument.getAnimations().length);'
pytestmark = [pytest.mark.slow, pytest.mark.skipif(MISSING, reason="chromium or axe is missing")]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    load("site").main(folder)
    report = folder / REPORT
    assert main(["report", str(kept_session(folder)), "-o", str(report)]) == 0
    # It lets no other script run, and folds what a referee wants.
    text = re.sub(r"<meta http-equiv=.Content-Security-Policy[^>]*>", "", report.read_text("utf-8"))
    report.write_text(text.replace("<details ", "<details open "), "utf-8")
    return folder


def ask_browser(built, tmp_path, work, *flags, width=1400):
    """What a script of ours says that visits pages of the site."""
    host = _HOST.replace("WORK", work).replace("WIDTH", str(width))
    (built / "host.htm").write_text(host, "utf-8")
    written = browse(
        tmp_path, "--window-size=1600,1000", "--virtual-time-budget=900000", *flags,
        "--allow-file-access-from-files", "--dump-dom", (built / "host.htm").as_uri(),
    )  # fmt: skip
    return json.loads(unescape(re.search(r"<title>(.*?)</title>", written, re.DOTALL)[1]))


@pytest.mark.parametrize(("scheme", "number"), [("slate", 0), ("default", 1)])
@pytest.mark.parametrize("width", [390, 820, 1400])
def test_axe_finds_nothing(built, tmp_path, width, scheme, number):
    pages = sorted(page.relative_to(built).as_posix() for page in built.rglob("*.html"))
    pages.remove("404.html")  # for servers: it looks for its style at their root
    assert len(pages) > 30
    flag = f"--blink-settings=preferredColorScheme={number}"
    axe = RUN_AXE.replace("SOURCE", AXE.as_uri())
    findings = {}
    for begin in range(0, len(pages), AT_ONCE):
        work = axe.replace("PAGES", json.dumps(pages[begin : begin + AT_ONCE]))
        findings |= ask_browser(built, tmp_path, work, flag, width=width)
    schemes = dict.fromkeys(pages, scheme) | {REPORT: None}  # whose style sheet asks the browser
    assert findings == {page: [[], False, schemes[page], True] for page in pages}


def test_search_works_in_pages_that_are_opened_as_files(built, tmp_path):
    assert re.search(r"[1-9] matching documents", ask_browser(built, tmp_path, _SEARCH))


def test_the_loop_rests_for_whoever_asks_for_less_motion(built, tmp_path):
    assert ask_browser(built, tmp_path, _LOOP) > 20
    assert ask_browser(built, tmp_path, _LOOP, "--force-prefers-reduced-motion") == 0
