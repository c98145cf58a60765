"""Figures are plain data; drawn, they are whole, the same each time, and hide nothing."""

from __future__ import annotations

import csv
import io
import signal
from dataclasses import replace
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest

from rig.analysis.result import Audit, DropResult, Measured
from rig.films import Film
from rig.measurands import SEPARATION
from rig.protocol.protocol import Run
from rig.report.canvas import KINDS, canvas
from rig.report.figure import Chart, csv_table
from rig.report.figures import budget_figure, result_figures, runs_figure, variance_shares
from rig.report.files import figure_file, write_figures
from rig.report.film import film_figure
from rig.report.layout import COLUMN_PT, WIDE_PT, lay_out
from rig.report.looks import SECOND
from rig.report.svg import figure_svg
from tests.report import fake_analysis

TWO = fake_analysis.two_chains()
CURVES = fake_analysis.curves()
FILM = Film(
    40.0, -0.02, [0.006] * 2, [[0.05], [0.1]], [0.19, None], [0.19, 0.2],
    [[[-0.05, 0.0, 0.1], [-0.05, 0.0, 0.15]]] * 2, [[[0.05, 0.0, 0.08], [0.05, 0.0, 0.17]]] * 2,
)  # fmt: skip
"""Two rods that do not move; the right string is shorter than at rest."""


def figures() -> list[Chart]:
    """One of each kind, of made-up results."""
    budget = {"runs": 1e-3, "common": 2e-3}
    means = {"separation_m": Measured(0.1, 5**0.5 * 1e-3, budget=budget)}
    causes = {"separation_m": {"datum": 4e-3, "beam heights": 3e-3, "width": 1e-5}}
    line = replace(TWO.summary[0], means=means, causes=causes)
    return [
        *result_figures(TWO, CURVES, simulated=True),
        *result_figures(fake_analysis.gravity(), {}, simulated=True, site_m_s2=9.82),
        runs_figure(TWO, simulated=True, skew_limit_s=0.005),
        budget_figure([line], simulated=True),
        film_figure(FILM),
    ]


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.title)
@pytest.mark.parametrize("width", [COLUMN_PT, WIDE_PT])
def test_a_figure_is_drawn_whole(figure, width):
    drawing = lay_out(figure, width)
    ElementTree.fromstring(figure_svg(drawing, figure.title, "wide"))
    assert drawing.texts[0].words == "SIMULATED DATA"
    for path in drawing.paths:
        points = np.array([point for line in path.lines for point in line]).reshape(-1, 2)
        assert np.isfinite(points).all()
        assert (points >= 0.0).all()
        assert (points <= (width, drawing.height)).all()
    shown = {text.words for text in drawing.texts}
    named = [series for panel in figure.panels for series in panel.series if series.label]
    assert {series.label for series in named} <= shown
    for panel in figure.panels:
        assert set(panel.y.label.split("\n")) <= shown | {""}


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.title)
def test_names_of_series_hide_no_other(figure):
    names = {series.label for panel in figure.panels for series in panel.series} - {""}
    drawing = lay_out(figure)
    boxes = [
        (text.x - (len(text.words) * 2.2 if text.anchor == "middle" else 0.0), text.y, text.words)
        for text in drawing.texts
        if text.words in names
    ]
    for (x, y, words), (other_x, other_y, other) in combinations(boxes, 2):
        apart = x + 4.4 * len(words) <= other_x or other_x + 4.4 * len(other) <= x
        assert apart or abs(y - other_y) > 6.0, (words, other)


def test_every_number_of_a_figure_is_in_its_table(tmp_path):
    (figure,) = result_figures(TWO, CURVES, simulated=True)
    rows = list(csv.DictReader(io.StringIO(csv_table(figure))))
    means = [row for row in rows if row["series"] == "means" and row["panel"] == "1"]
    expected = [100.0 * line.means["separation_m"].expanded for line in TWO.summary]
    assert [float(row["U95"]) for row in means] == expected
    write_figures(tmp_path, [figure])
    names = {f"figure-1.{kind}" for kind in (*KINDS, "csv")}
    assert {path.name for path in tmp_path.iterdir()} == names
    for kind in KINDS:
        assert (tmp_path / f"figure-1.{kind}").read_bytes() == figure_file(figure, kind)


def test_points_stand_at_the_incline_at_which_they_were_measured():
    (figure,) = result_figures(TWO, CURVES, simulated=False)
    points = [series for series in figure.panels[0].series if series.role in {"points", "mean"}]
    assert {x for series in points for x in series.x} == set(fake_analysis.MODEL)


def test_residuals_are_normalized_errors():
    (figure,) = result_figures(TWO, CURVES, simulated=False)
    points = figure.panels[1].series[-1]
    assert list(points.y) == [line.normalized_error("separation_m") for line in TWO.summary]
    assert figure.panels[1].series[0].y == (-1.0, 1.0)


def test_figures_follow_the_scene():
    (single,) = result_figures(fake_analysis.single_chain(), {}, simulated=False)
    assert "eparation" not in single.title
    assert runs_figure(fake_analysis.gravity(), simulated=False) is None
    (gravity,) = result_figures(fake_analysis.gravity(), {}, simulated=False)
    assert [panel.x.label for panel in gravity.panels] == ["run"]
    void = DropResult(Run(1, 40.0, "A", "B"), 1, "void", (), Audit(0, 0, 50, 0, 0))
    for analysis in (fake_analysis.EMPTY, fake_analysis.analysis([void], [])):
        assert not list(result_figures(analysis, CURVES, simulated=False))
        assert runs_figure(analysis, simulated=False) is None
        assert budget_figure(analysis.summary, simulated=False) is None


def test_a_void_run_does_not_set_the_scale():
    runs = list(TWO.runs)
    number = next(i for i, run in enumerate(runs) if run.verdict == "void")
    runs[number] = fake_analysis.measured(runs[number], separation_m=Measured(9.0, 0.001))

    def numbers(runs):
        figure = runs_figure(replace(TWO, runs=tuple(runs)), simulated=False)
        return [text.words for text in lay_out(figure).texts if text.anchor == "end"]

    assert numbers(runs) == numbers(TWO.runs)


def test_shares_of_a_variance_add_up_to_the_whole():
    (line,) = [line for line in TWO.summary if line.incline_deg == 40.0]
    mean = Measured(0.1, 5e-3, budget={"runs": 3e-3, "common": 4e-3})
    line = replace(line, means={"separation_m": mean}, causes={"separation_m": {"datum": 4e-3}})
    assert variance_shares([line], SEPARATION) == pytest.approx({"runs": 0.36, "datum": 0.64})


def test_slack_strings_are_drawn_apart():
    slack = [series for series in film_figure(FILM).panels[0].series if series.color == SECOND]
    assert any(series.x for series in slack)


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_ctrl_c_waits_until_a_figure_is_drawn_and_until_it_is_written(kind, monkeypatch) -> None:
    """From matplotlib's C++ an exception would end the process, without a word."""
    drawings = []

    def drawn() -> None:
        with canvas((1.0,), simulated=True) as drawing:
            signal.raise_signal(signal.SIGINT)
            drawings.append(drawing)

    with pytest.raises(KeyboardInterrupt):
        drawn()
    (drawing,) = drawings
    write = drawing.figure.draw

    def struck(renderer) -> None:
        signal.raise_signal(signal.SIGINT)
        write(renderer)
        drawings.append(drawing)

    monkeypatch.setattr(drawing.figure, "draw", struck)
    with pytest.raises(KeyboardInterrupt):
        drawing.file(kind)
    assert len(drawings) > 1
