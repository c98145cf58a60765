"""The page: whole, self-contained, and no text of a file becomes part of it."""

import base64
import re
from collections import defaultdict
from collections.abc import Callable
from datetime import datetime
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace as Simple
from typing import Any
from unittest.mock import Mock

import yaml

from rig import __version__
from rig.analysis.result import GOOD, Audit, DropResult
from rig.protocol.protocol import Condition, Run
from rig.records import Job
from rig.report.attachments import METHOD, Attachment, method_page
from rig.report.columns import Part
from rig.report.figure import Chart, Panel, PlotAxis, Trace
from rig.report.finding import ModelCheck, Number
from rig.report.templates import page_html, sentence
from rig.report.timeline import Lanes, Timeline

ROOT = Path(__file__).parents[2]
VOID_TAGS = {"meta", "br", "hr", "img", "link"}
BAD = '<script>alert("x")</script>&\'</pre></style>'


class Balance(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open, self.ids, self.links = [], [], []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values[key] for key in ("href", "src") if key in values]
        if tag not in VOID_TAGS:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert tag in VOID_TAGS or self.open.pop() == tag


def parse(page: str) -> Balance:
    parser = Balance()
    parser.feed(page)
    assert not parser.open
    return parser


def always(value: Any) -> Callable[..., Any]:
    return lambda *_: value


def page_with(text: str) -> dict[str, Any]:
    """Return a session's page that says one text wherever a page says anything."""
    axis, ends = PlotAxis(text), [0.0, 1.0]
    panel = Panel(axis, axis, [Trace(text[:8], ends, ends, "line")])
    charts = always([Chart(text, text, [panel])])
    tables = always([Part(text, [text], [(text, False)], [[text]])])
    words = always([text])
    result = DropResult(Run(1, 40.0, text, text), 1, text, (), Audit())
    session = Simple(
        path=Simple(name=text), meta=defaultdict(lambda: text), protocol_text=text,
        protocol_source=text, states=words, identities=always([(0, text)]),
        attached_files=always([Simple(name=text, added=text)]),
    )  # fmt: skip
    analysis = Simple(
        runs=(result,), drops=[result], superseded=(), damage=[text],
        summary=(Simple(condition=Condition(1.0), gates=(), means={}),),
        rig=Simple(likeness=Simple(sentence=text), drag=None),
    )  # fmt: skip
    outcome = Mock(blind=False, analysis=analysis, clock=Simple(details={text: text}))
    return {
        "template": "session.html", "title": text, "simulated": True, "session": session,
        "outcome": outcome, "timed": (), "good": GOOD, "created": datetime(2026, 6, 3),
        "protocol": Mock(notes=text, track=None), "notes": {Job(1, 1): text},
        "make": lambda _, make, *arguments: make(*arguments), "bars": "U95",
        "estimated": True, "sections": Simple(failed={"a": text}),
        "versions": {"rig": text},
        "curves": defaultdict(lambda: always([{}])), "fall": charts, "fallen": charts,
        "figures": defaultdict(lambda: charts, FEWEST_INCLINES=3), "plan": {"runs": always([])},
        "parts": defaultdict(lambda: tables, means_of=always([])),
        "estimate": {"page_parts": tables},
        "timeline": {"timelines": always((Lanes((), 1.0), [Timeline(result, "", "M0 0")]))},
        "attachments": {"attachments": always([Attachment(text, text, "1", text)])},
        "finding": defaultdict(lambda: words, verdict=always(ModelCheck(text, False)),
                               headline=always([Number(text, text, text)])),
        "improvements": {"improvements": always([{"sentence": text}])},
    }  # fmt: skip


def test_the_page_is_whole_and_needs_nothing_else():
    page = page_html(page_with("Text"))[0]
    parser = parse(page)
    assert len(parser.ids) == len(set(parser.ids))
    places = [link[1:] for link in parser.links if not link.startswith("data:")]
    assert set(places) <= set(parser.ids)
    assert "SIMULATED DATA" in page
    (script,) = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in page


def test_text_is_escaped():
    plain, bad = page_html(page_with("Text"))[0], page_html(page_with(BAD))[0]
    parse(bad)
    for tag in ("<script", "</style>", "</pre>"):
        assert bad.count(tag) == plain.count(tag)
    assert bad.count("&lt;script&gt;") >= plain.count("Text")


def test_page_and_citation_file_name_the_same():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert cited["version"] == __version__
    assert __version__ in sentence("software", __version__)
    assert cited["title"].partition(":")[2].strip() in sentence("software", __version__)
    (paper,) = cited["references"]
    assert paper["title"] in sentence("paper")
    assert paper["identifiers"][0]["value"] in sentence("paper")
    assert method_page() == (ROOT / "docs" / METHOD).read_text("utf-8")
