"""The site in a real browser: axe finds nothing on any page, at three widths, in both schemes.

Of `./run bench soaks`, for a browser is large; `test_site.py` holds what can be told without one.
"""

from __future__ import annotations

import json
import os
import re
from html import unescape
from pathlib import Path

import pytest

from tests.report.test_browser import BROWSER, browse
from tests.test_site import load

AXE = Path(__file__).parent / "axe/node_modules/axe-core/axe.min.js"
AT_ONCE = 10  # pages a browser visits before it is started anew
MISSING = (BROWSER is None or not AXE.is_file()) and not os.environ.get("CI")
_SEARCH = """<title></title><iframe src="docs/method.html" width="1400" height="900"></iframe>
<script>
const frame = document.querySelector("iframe");
frame.onload = () => {
  const inside = frame.contentWindow, page = inside.document;
  const field = page.querySelector("[data-md-component=search-query]");
  page.querySelector("#__search").click();
  field.focus();
  field.value = "photogate";
  field.dispatchEvent(new inside.Event("input", { bubbles: true }));
  const results = page.querySelector(".md-search-result__meta");
  new MutationObserver(() => { document.title = JSON.stringify(results.textContent); })
    .observe(results, { childList: true, characterData: true });
};
</script>"""
_LOOP = """<title></title><iframe src="docs/pictures/loop.svg"></iframe><script>
document.querySelector("iframe").onload = (event) => {
  document.title = event.target.contentDocument.getAnimations().length;
};
</script>"""
_HOST = """<title></title><body><script>
const pages = PAGES, findings = {};
const visit = async (page) => {
  const frame = document.createElement("iframe");
  Object.assign(frame, { width: WIDTH, height: 900, title: "page", src: page });
  const loaded = new Promise((done) => { frame.onload = done; });
  document.body.append(frame);
  await loaded;
  const inside = frame.contentWindow, html = inside.document.documentElement;
  const script = inside.document.createElement("script");
  script.src = "AXE";
  const ready = new Promise((done) => { script.onload = done; });
  inside.document.body.append(script);
  await ready;
  const found = await inside.axe.run(inside.document);
  findings[page] = {
    axe: found.violations.map((rule) => [rule.id, rule.nodes.map((node) => node.target.join(" "))]),
    passes: found.passes.length,
    wide: html.scrollWidth > inside.innerWidth,
    dark: inside.document.body.dataset.mdColorScheme === "slate",
  };
  frame.remove();
};
(async () => {
  for (const page of pages) await visit(page);
  document.title = JSON.stringify(findings);
})();
</script></body>"""


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(MISSING, reason="chromium or axe (npm ci in tests/axe) is not installed"),
]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    load("site").main(folder)
    return folder


def title(built, tmp_path, host, *flags):
    """What a page of ours beside those of the site writes into its title."""
    (built / "host.htm").write_text(host, "utf-8")
    written = browse(
        tmp_path, "--window-size=1600,1000", "--virtual-time-budget=900000", *flags,
        "--allow-file-access-from-files", "--dump-dom", (built / "host.htm").as_uri(),
    )  # fmt: skip
    return json.loads(unescape(re.search(r"<title>(.*?)</title>", written, re.DOTALL)[1]))


@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.parametrize("width", [390, 820, 1400])
def test_axe_finds_nothing(built, tmp_path, width, scheme):
    pages = sorted(page.relative_to(built).as_posix() for page in built.rglob("*.html"))
    pages.remove("404.html")  # for servers: it looks for its style at their root
    assert len(pages) > 30
    host = _HOST.replace("AXE", AXE.as_uri()).replace("WIDTH", str(width))
    flag = f"--blink-settings=preferredColorScheme={0 if scheme == 'dark' else 1}"
    findings = {}
    for begin in range(0, len(pages), AT_ONCE):
        some = json.dumps(pages[begin : begin + AT_ONCE])
        findings |= title(built, tmp_path, host.replace("PAGES", some), flag)
    assert set(findings) == set(pages)
    for page, finding in findings.items():
        assert finding.pop("passes") > 10, page
        assert finding == {"axe": [], "wide": False, "dark": scheme == "dark"}, page


def test_search_works_in_pages_that_are_opened_as_files(built, tmp_path):
    assert re.search(r"[1-9] matching documents", title(built, tmp_path, _SEARCH))


def test_the_loop_rests_for_whoever_asks_for_less_motion(built, tmp_path):
    assert title(built, tmp_path, _LOOP) > 20
    assert title(built, tmp_path, _LOOP, "--force-prefers-reduced-motion") == 0
