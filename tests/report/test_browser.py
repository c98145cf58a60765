"""The page on paper, from a browser and without; `tests/cli/test_board_browser.py` looks at it too.

Of `./run bench soaks`, for a browser is large; `test_page.py` holds what can be told without one.
"""

import os
import shutil
from pathlib import Path

import pytest

from rig.cli import main
from tests.programs import run_program
from tests.tui.lab import kept_session

BROWSER = shutil.which("chromium")
MISSING = BROWSER is None and not os.environ.get("CI")
_QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-quic",
)  # fmt: skip
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(MISSING, reason="Debian's chromium is not installed"),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    assert main(["report", str(kept_session(folder)), "-o", str(folder / "report.html")]) == 0
    return folder / "report.html"


def browse(folder: Path, *arguments: str) -> str:
    command = [BROWSER, *_QUIET, f"--user-data-dir={folder / 'profile'}", *arguments]
    done = run_program(*command)
    return done.stdout


def read_pages(paper: Path) -> list[str]:
    written = run_program("pdftotext", paper, "-")
    return written.stdout.split("\f")[:-1]


def test_print_has_no_empty_page(page, tmp_path):
    paper = tmp_path / "page.pdf"
    browse(tmp_path, f"--print-to-pdf={paper}", page.as_uri())
    pages = read_pages(paper)
    assert len(pages) > 2
    assert all(len(text.split()) > 10 for text in pages)
    assert "separation Δz (cm)" in pages[0], "the first figure is on the first page"
    appendix = next(n for n, text in enumerate(pages) if "Appendix: Every drop" in text)
    assert all("attempt" in text for text in pages[appendix:]), "each page of a table has its head"
    assert "data.zip" not in "".join(pages), "nothing is attached to what a browser prints"


def test_a_pdf_needs_no_browser(page, tmp_path):
    paper, session = tmp_path / "report.pdf", page.with_name("looks.session")
    assert main(["report", str(session), "-o", str(tmp_path / "a.html"), "--pdf", str(paper)]) == 0
    pages = read_pages(paper)
    assert 2 < len(pages) <= 5
    assert "Figure 1." in pages[0]
    assert all(text.split()[-1] == str(number) for number, text in enumerate(pages, 1))
    assert "Choose" not in "".join(pages), "nobody can click on paper"
    listed = run_program("pdfdetach", "-list", paper)
    assert {"data.zip", "method.md"} <= set(listed.stdout.split())
