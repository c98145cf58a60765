"""The page: whole, self-contained, and no text of a file becomes part of it."""

import base64
import json
import re
from hashlib import sha256
from html.parser import HTMLParser

import pytest
import yaml

from rig import __version__
from rig.cli import main
from rig.reasons import OPERATOR, plain_reason
from rig.report.attachments import METHOD, method_page
from rig.report.templates import sentence
from rig.session.schema import RunState
from rig.session.store import Session
from tests.cli.lab import ROOT, record, short_fence

VOID_TAGS = {"meta", "br", "hr", "img", "link"}
LOADING = ("href", "src", "srcset", "data", "action", "poster")
BAD = '<script>alert("x")</script>&\'</pre></style>'


class Balance(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open, self.ids, self.links = [], [], []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values[key] for key in LOADING if key in values]
        if tag not in VOID_TAGS:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert tag in VOID_TAGS or self.open.pop() == tag


def parse(page: str) -> Balance:
    parser = Balance()
    parser.feed(page)
    assert not parser.open
    return parser


def reported(folder, said):
    """Return the page of a session that says so wherever it can."""
    folder.mkdir()
    title = f"title: {json.dumps(said)}\nnotes: {json.dumps(said)}  # {said}"
    session = record(folder, re.sub("(?m)^title: .*$", lambda _: title, short_fence()))
    assert main(["notes", str(session), "--run", "1", said]) == 0
    with Session.open(session) as opened:
        opened.add_state(2, 1, RunState.REJECTED, 0, [plain_reason(said, OPERATOR)])
    assert main(["report", str(session), "-o", str(folder / "page.html")]) == 0
    return (folder / "page.html").read_text("utf-8")


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return reported(tmp_path_factory.mktemp("plain") / "page", "Text")


def test_the_page_is_whole_and_needs_nothing_else(plain):
    parser = parse(plain)
    assert len(parser.ids) == len(set(parser.ids))
    assert {link[1:] for link in parser.links if not link.startswith("data:")} <= {*parser.ids}
    assert not re.search(r"@import|url\((?!\s*[\"']?#)|<script |<link|<iframe|<object", plain)
    assert "default-src 'none'" in plain
    assert not re.findall(r"https?://(?!www\.w3\.org/)[^\s<]*", plain)
    (script,) = re.findall(r"<script>(.*?)</script>", plain, re.DOTALL)
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in plain


def test_text_is_escaped(plain, tmp_path):
    bad = reported(tmp_path / "bad", BAD)
    parse(bad)
    for tag in ("<script", "</style>", "</pre>"):
        assert bad.count(tag) == plain.count(tag)
    assert bad.count("&lt;script&gt;") >= plain.count("Text") > 6


def test_page_and_citation_file_name_the_same():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert cited["version"] == __version__
    assert __version__ in sentence("software", __version__)
    assert cited["title"].partition(":")[2].strip() in sentence("software", __version__)
    (paper,) = cited["references"]
    assert paper["title"] in sentence("paper")
    assert paper["identifiers"][0]["value"] in sentence("paper")
    assert method_page() == (ROOT / "docs" / METHOD).read_text("utf-8")
