"""The site in a real browser: axe finds nothing on any page, at three widths, in both schemes.

Of `./run bench soaks`, for a browser is large; `test_site.py` holds what can be told without one.
"""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest

from tests.report.test_browser import BROWSER, browse, pytestmark  # noqa: F401
from tests.test_site import load

AXE = Path(__file__).parent / "axe/node_modules/axe-core/axe.min.js"
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


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    load("site").main(folder)
    return folder


@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.parametrize("width", [390, 820, 1400])
def test_axe_finds_nothing(built, tmp_path, width, scheme):
    pages = sorted(page.relative_to(built).as_posix() for page in built.rglob("*.html"))
    pages.remove("404.html")  # for servers: it looks for its style at their root
    assert len(pages) > 30
    host = _HOST.replace("PAGES", json.dumps(pages)).replace("WIDTH", str(width))
    (built / "host.txt").write_text(host.replace("AXE", AXE.as_uri()), "utf-8")
    (built / "host.txt").rename(built / "host.htm")
    found = browse(
        tmp_path, "--window-size=1600,1000", "--virtual-time-budget=900000",
        f"--blink-settings=preferredColorScheme={0 if scheme == 'dark' else 1}",
        "--allow-file-access-from-files", "--dump-dom", (built / "host.htm").as_uri(),
    )  # fmt: skip
    title = re.search(r"<title>(.*?)</title>", found, re.DOTALL)
    findings = json.loads(unescape(title[1]))
    assert set(findings) == set(pages)
    for page, finding in findings.items():
        assert finding.pop("passes") > 10, page
        assert finding == {"axe": [], "wide": False, "dark": scheme == "dark"}, page
