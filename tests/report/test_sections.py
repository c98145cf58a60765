"""Sections of a page or a text fail alone, and say so."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from rig.analysis.result import Measured
from rig.cli import main
from rig.errors import InputError
from rig.estimate.posterior import Posterior
from rig.estimate.session import Coefficient, estimate
from rig.report.estimate import page_parts
from rig.report.estimate_figures import estimate_pictures
from rig.report.session_page import session_page
from rig.report.templates import page_html
from rig.results.whole import complete_analysis, protocol_of, results
from rig.sections import Sections
from rig.session.store import Session
from rig.units import Quantity
from tests.analysis.kept_results import FOLDER
from tests.tables import cases


@pytest.fixture(scope="module")
def single():
    """A session of a single chain with two good drops."""
    return FOLDER / "single.session"


@pytest.fixture(scope="module")
def found(single):
    with Session.open(single, readonly=True) as session:
        return estimate(protocol_of(session), complete_analysis(session))


def changed(found, **gain):
    """Have other speeds gained from the rods of each incline."""
    return replace(
        found,
        impulses=tuple(
            one._replace(gains=tuple(each._replace(**gain) for each in one.gains))
            for one in found.impulses
        ),
    )


def test_a_part_that_fails_takes_no_other_along(found):
    broken = changed(found, eq9_m_s="much")
    sections = Sections()
    headings = [part.heading for part in page_parts(broken, sections)]
    assert "Best single α" in headings
    assert "The protocol's model" in headings
    drawn = estimate_pictures(broken, sections)
    whole = estimate_pictures(found, Sections())
    assert set(drawn) == set(whole) - {"impulses"}
    assert sections.failed["The picture of the impulses"].startswith(
        "The picture of the impulses could not be made: ValueError: "
    )


def test_a_page_says_what_it_lacks(single, monkeypatch):
    def fail(*_, **__):
        raise TypeError("must be real number, not str")

    for name in ("figures.budget_figure", "figures.result_figure", "session_page.fall_figures"):
        monkeypatch.setattr(f"rig.report.{name}", fail)
    with Session.open(single, readonly=True) as session:
        sections = Sections()
        page, _ = page_html(session_page(session, results(session), "U95", None, sections))
    assert len(sections.failed) == 3
    for sentence in sections.failed.values():
        assert sentence in page
    assert "The figure of the budget could not be made: TypeError: " in page
    assert "sortable" in page


def test_a_missing_package_is_no_failed_section():
    sections = Sections()

    with pytest.raises(ModuleNotFoundError), sections.alone("one"):
        raise ModuleNotFoundError("no scipy", name="scipy")
    with pytest.raises(InputError), sections.alone("one"):
        raise InputError("no figures") from ImportError("matplotlib")
    assert not sections.failed
    with sections.alone("one"):
        raise InputError("no good drop", "see why")
    assert sections.failed == {"one": "one could not be made: no good drop"}


@cases
def test_what_an_estimate_lacks_is_said_in_the_report_and_on_stderr(
    single, tmp_path, capsys, monkeypatch, where, words
):
    monkeypatch.setattr(where, Mock(side_effect=ZeroDivisionError("float division\nby zero")))
    assert main(["report", str(single), "-o", str(tmp_path / "r.html"), "--estimate"]) == 0
    sentence, last = capsys.readouterr().err.splitlines()
    assert sentence.endswith(f"{words}: ZeroDivisionError: float division by zero")
    assert last == f"report: {tmp_path / 'r.html'}"
    html = (tmp_path / "r.html").read_text("utf-8")
    assert all(words in html for words in (sentence, "sortable", "Height against time"))


@pytest.mark.parametrize("what", [{"weights": [1.0]}, {"sds": 0.0}])
def test_a_posterior_without_spread_has_no_picture(found, what):
    nodes = [[0.5, 0.2], [0.5, 0.21]][: len(what.get("weights", (1, 1)))]
    names = ("restitution", "friction")
    told = Measured(0.5, 0.1)
    narrow = found.coefficients._replace(
        parameters=tuple(
            Coefficient(name, True, told, Quantity(0.5), {"u": 0.1, "low": 0.3, "high": 0.7})
            for name in names
        ),
        posterior=Posterior(
            names,
            np.full(len(nodes), 1.0 / len(nodes)),
            np.array(nodes),
            np.array([[0.05, 1e-9] if "weights" in what else [1e-300, 1e-9]] * len(nodes)),
        ),
    )
    sections = Sections()
    drawn = estimate_pictures(replace(found, coefficients=narrow), sections)
    assert "posterior" not in drawn
    assert not sections.failed
