"""The page in a real browser: at three widths, in both colour schemes, and in print.

Of `./run bench soaks`, for a browser is large; `test_html.py` holds what can be told without one.
"""

from __future__ import annotations

import json
import lzma
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rig.cli import main
from tests.tui.test_pictures import RECORDED

BROWSER = shutil.which("chromium")
MISSING = BROWSER is None and not os.environ.get("CI")
READABLE = 4.5
"""Contrast that WCAG 2.1 asks of text (1.4.3)."""
_QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-quic",
)  # fmt: skip
_PROBE = """<script>
const luminance = (colour) => {
  const [r, g, b] = colour.match(/[0-9.]+/g).slice(0, 3).map((c) => c / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const paper = (one) => {
  for (; one; one = one.parentElement) {
    const colour = getComputedStyle(one).backgroundColor;
    if (!/, 0\\)$|transparent/.test(colour)) return colour;
  }
  return matchMedia("(prefers-color-scheme: dark)").matches ? "rgb(0,0,0)" : "rgb(255,255,255)";
};
addEventListener("load", () => {
  document.querySelectorAll("details").forEach((one) => { one.open = true; });
  const faint = [], texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let count = 0;
  while (texts.nextNode()) {
    const one = texts.currentNode.parentElement;
    if (!texts.currentNode.data.trim() || one.closest("svg, script, style")) continue;
    count += 1;
    const both = [luminance(getComputedStyle(one).color), luminance(paper(one))];
    const contrast = (Math.max(...both) + 0.05) / (Math.min(...both) + 0.05);
    if (contrast < LEAST) faint.push(`${texts.currentNode.data.trim()}: ${contrast}`);
  }
  const figures = [...document.querySelectorAll("figure svg")]
    .map((one) => one.getBoundingClientRect());
  parent.postMessage(JSON.stringify({
    width: innerWidth, whole: document.documentElement.scrollWidth, count, faint,
    dark: matchMedia("(prefers-color-scheme: dark)").matches,
    figures: figures.map((one) => [one.left, one.right, one.height]),
  }), "*");
});
</script></body>"""
_HOST = """<title>none</title><iframe src="page.html" width="WIDTH" height="900"></iframe>
<script>addEventListener("message", (e) => { document.title = e.data; });</script>"""

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


@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.parametrize("width", [390, 820, 1400])
def test_all_can_be_read_at_any_width_in_both_schemes(page, tmp_path, width, scheme):
    probe = _PROBE.replace("LEAST", str(READABLE))
    text = page.read_text("utf-8")
    assert "</body>" in text
    allowed = re.sub(r"<meta http-equiv=.Content-Security-Policy[^>]*>", "", text)
    (tmp_path / "page.html").write_text(allowed.replace("</body>", probe), "utf-8")
    (tmp_path / "host.html").write_text(_HOST.replace("WIDTH", str(width)), "utf-8")
    found = browse(
        tmp_path, "--window-size=1600,1000", "--virtual-time-budget=5000",
        f"--blink-settings=preferredColorScheme={0 if scheme == 'dark' else 1}",
        "--dump-dom", (tmp_path / "host.html").as_uri(),
    )  # fmt: skip
    title = re.search(r"<title>(.*?)</title>", found, re.DOTALL)
    said = json.loads(title[1].replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">"))
    assert said["dark"] == (scheme == "dark")
    assert said["count"] > 200
    assert not said["faint"]
    assert said["whole"] <= said["width"], "the page itself scrolls sideways"
    assert said["figures"]
    for left, right, height in said["figures"]:
        assert left >= 0.0
        assert height > 0.3 * (right - left) or height == 0.0


def read_pages(paper: Path) -> list[str]:
    written = subprocess.run(["pdftotext", paper, "-"], capture_output=True, text=True, check=True)
    return written.stdout.split("\f")[:-1]


def test_print_has_no_empty_page(page, tmp_path):
    paper = tmp_path / "page.pdf"
    browse(tmp_path, f"--print-to-pdf={paper}", page.as_uri())
    pages = read_pages(paper)
    assert len(pages) > 2
    assert all(len(text.split()) > 10 for text in pages)
    assert "separation Δz (cm)" in pages[0], "the first figure is on the first page"


def test_a_pdf_needs_no_browser(page, tmp_path):
    paper, session = tmp_path / "report.pdf", page.with_name("a.session")
    assert main(["report", str(session), "-o", str(tmp_path / "a.html"), "--pdf", str(paper)]) == 0
    pages = read_pages(paper)
    assert 2 < len(pages) <= 6
    assert "Figure 1." in pages[0]
    assert all(text.split()[-1] == str(number) for number, text in enumerate(pages, 1))
    assert "Choose" not in "".join(pages), "nobody can click on paper"
    listed = subprocess.run(
        ["pdfdetach", "-list", paper], capture_output=True, text=True, check=True
    )
    assert {"data.zip", "method.md"} <= set(listed.stdout.split())
