"""The page: whole, self-contained, and no text of a file becomes part of it."""

import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

from rig.analysis.result import Audit, DropResult, Measured
from rig.analysis.session import Analysis
from rig.protocol.protocol import Run
from rig.reasons import plain_reason
from rig.report.html import ReportContext, report_html
from rig.report.pictures import pictures
from rig.sections import Sections
from tests.report import fake_analysis

VOID_TAGS = {"meta", "br", "hr", "img", "link"}


@cache
def context() -> ReportContext:
    """A session of two chains; to draw its figures takes most of a second."""
    two = fake_analysis.two_chains(repeats=4)
    curves = fake_analysis.curves()
    return ReportContext(
        title="Uniform rod chains",
        analysis=two,
        simulated=True,
        figures=pictures(two, curves, True, skew_limit_s=0.005, sections=Sections()),
        protocol_text="protocol: 1\n",
        protocol_source="uniform.yaml",
        protocol_sha256="ab" * 32,
        provenance={"session": "a.rig", "created": "2025-01-01T00:00:00+00:00"},
        identities=[{"serial": "A1", "tick_hz": 2_000_000}],
        clock={"rate (ppm)": -1330.0},
        notes=["Air drag is left out."],
    )


class Balance(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.ids += [values["id"] or ""] if "id" in values else []
        self.links += [values[key] or "" for key in ("xlink:href", "href", "src") if key in values]
        if tag not in VOID_TAGS:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID_TAGS:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def parse(page: str) -> Balance:
    parser = Balance()
    parser.feed(page)
    parser.close()
    assert not parser.open
    return parser


def test_the_page_is_whole_and_needs_nothing_else() -> None:
    page = report_html(context())
    parser = parse(page)
    assert len(parser.ids) == len(set(parser.ids))
    places = [link[1:] for link in parser.links if not link.startswith("data:")]
    assert set(places) <= set(parser.ids)
    assert set(re.findall(r"url\(#(.*?)\)", page)) <= set(parser.ids)
    assert "<script" not in page
    for text in (
        "SIMULATED DATA",
        "Eₙ",
        "ab" * 32,
        "-1330.0",
        "serial A1",
        "Air drag",
        "226 / 225 / 1 / 0 / 0",
    ):
        assert text in page
    assert page == report_html(context())


def test_text_is_escaped() -> None:
    bad = '<script>alert("x")</script>&\'</pre></style>'
    one = DropResult(
        Run(1, 40.0, bad, bad),
        1,
        "void",
        (plain_reason(bad),),
        Audit(0, 0, 0, 0, 0),
        {bad: Measured(1.0, 1.0, budget={bad: 1.0})},
    )
    figures = [replace(picture, alt=bad, caption=bad) for picture in context().figures]
    page = report_html(
        ReportContext(
            title=bad,
            analysis=Analysis((one,), (one,), ()),
            simulated=True,
            figures=figures,
            protocol_text=bad,
            protocol_source=bad,
            protocol_sha256=bad,
            provenance={bad: bad},
            identities=[{bad: bad}],
            clock={bad: bad},
            notes=[bad],
        )
    )
    parser = parse(page)
    assert parser.ids
    assert "<script" not in page
    assert page.count("</style>") == page.count("<style")
    assert page.count("</pre>") == 1


def test_what_is_missing_is_left_out() -> None:
    analysis = fake_analysis.gravity()
    page = report_html(ReportContext(title="Picket fence", analysis=analysis, simulated=False))
    parse(page)
    for absent in ("SIMULATED", "Δz", "skew", "Provenance", "budget", "Earlier", "impact chain"):
        assert absent not in page
    assert "9.8188 ± 0.0027" in page
    single = fake_analysis.single_chain()
    page = report_html(ReportContext(title="One chain", analysis=single, simulated=False))
    assert "raw Δz" not in page
    assert "skew" not in page.replace("release skew 5.3 ms", "").replace(">release skew<", "")


def test_importing_loads_neither_matplotlib_nor_numpy() -> None:
    code = (
        "import sys, rig.report.html, rig.report.pictures, rig.report.columns, rig.session.export,"
        "rig.session.store\n"
        "assert not {'matplotlib', 'numpy'} & set(sys.modules)"
    )
    root = str(Path(__file__).parents[2])
    subprocess.run([sys.executable, "-c", code], check=True, env={"PYTHONPATH": root})
