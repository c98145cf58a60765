"""The report in a real browser, and in print; `tests/cli/test_board_browser.py` looks at it too.

Of `./run bench soaks`, for a browser is large; `test_html.py` holds what can be told without one.
"""

from __future__ import annotations

import lzma
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from rig.cli import main
from tests.tui.test_pictures import RECORDED

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
    session = folder / "a.session"
    session.write_bytes(lzma.decompress(RECORDED.read_bytes()))
    assert main(["report", str(session), "-o", str(folder / "report.html")]) == 0
    return folder / "report.html"


def browse(folder: Path, *arguments: str) -> str:
    command = [BROWSER, *_QUIET, f"--user-data-dir={folder / 'profile'}", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    return done.stdout


def test_print_has_no_empty_page(page, tmp_path):
    paper = tmp_path / "page.pdf"
    browse(tmp_path, f"--print-to-pdf={paper}", page.as_uri())
    text = subprocess.run(
        ["pdftotext", str(paper), "-"], capture_output=True, text=True, check=True
    ).stdout
    pages = text.split("\f")[:-1]
    assert len(pages) > 2
    assert all(len(one.split()) > 10 for one in pages)
