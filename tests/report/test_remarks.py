"""What is said of void drops and of the air, and that sessions say it."""

from __future__ import annotations

from types import SimpleNamespace

from rig.analysis.result import Audit, DropResult, Measured
from rig.analysis.session import Analysis
from rig.protocol.protocol import Run
from rig.reasons import make_reason, plain_reason, remedies
from rig.report.finding import void_lines
from rig.report.templates import lines
from rig.wordings import OPERATOR, SENTENCE, WORDINGS, Severity


def void(run, attempt, *reasons, verdict="void"):
    planned = Run(run, 40.0, "A", "B")
    return DropResult(planned, attempt, verdict, reasons, Audit(0, 0, 0, 0, 0))


SKEW = make_reason("release_skew", skew_s=9.19e-3, limit_s=5e-3)
MISSED = make_reason("edges_missed", missed=34, expected=660, limit=0.05)
MOTHS = plain_reason("moths")


def test_each_void_has_a_remedy_and_the_general_one_only_where_nothing_else_is_known():
    known = {code: row.remedy for code, row in WORDINGS.items() if row.severity is Severity.VOID}
    without = [code for code, remedy in known.items() if not remedy]
    assert without == [OPERATOR]
    assert [code for code, remedy in known.items() if remedy == WORDINGS["scatter"].remedy] == [
        SENTENCE
    ]
    (general,) = remedies([MOTHS, plain_reason("a lorry")])
    assert remedies([MOTHS, SKEW, SKEW]) == remedies([SKEW]) != [general]


def test_void_drops_of_one_reason_share_a_line_above_what_to_do():
    last = void(2, 1, SKEW, MISSED), void(3, 2, verdict="accepted"), void(4, 1, MOTHS)
    lines = void_lines(Analysis(last, (void(3, 1, SKEW),), ()))
    assert lines[1:4] == [
        f"  runs 2, 3: {SKEW}",
        f"  run 2: {MISSED}",
        "  run 4: moths",
    ]
    worse = make_reason("release_skew", skew_s=20e-3, limit_s=5e-3)
    again = void_lines(Analysis((void(2, 2, worse),), (void(2, 1, SKEW),), ()))
    assert again[1] == "  run 2 (attempts 1–2): release skew"
    assert [line.strip() for line in lines[5:]] == remedies([SKEW, MISSED])
    assert void_lines(Analysis((void(1, 1, verdict="marginal"),), (), ())) == []


def test_air_that_may_be_none_is_not_mentioned():
    for nothing in (None, Measured(3e-6, 1e-6), Measured(-3e-6, 1e-6)):
        assert lines("air", SimpleNamespace(rig=nothing and SimpleNamespace(drag=nothing))) == []


def test_air_is_said_with_its_uncertainty():
    (line,) = lines("air", SimpleNamespace(rig=SimpleNamespace(drag=Measured(0.0312345, 1e-5))))
    assert "κ = 0.031234 ± 0.000020 per m" in line
