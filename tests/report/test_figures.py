"""Figures are well-formed, repeat byte for byte, and survive what is missing."""

import re
import signal
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from rig.analysis.result import Audit, DropResult, Measured
from rig.films import Film
from rig.protocol.protocol import Run
from rig.report.canvas import PAPER, PARTS, SECOND, Canvas, canvas
from rig.report.embed import dark_figure_css
from rig.report.figures import gravity_figure, incline_figure, runs_figure
from rig.report.film import film_figure
from rig.report.pictures import pictures
from rig.sections import Sections
from tests.report import fake_analysis

TWO = fake_analysis.two_chains()
CURVES = fake_analysis.curves()
FILM = Film(
    40.0, -0.02, [0.006] * 2, [[0.05], [0.1]], [0.19, None], [0.19, 0.2],
    [[[-0.05, 0.0, 0.1], [-0.05, 0.0, 0.15]]] * 2, [[[0.05, 0.0, 0.08], [0.05, 0.0, 0.17]]] * 2,
)  # fmt: skip
"""Two rods that do not move; the right string is shorter than at rest."""


def all_three() -> list[str]:
    return [
        incline_figure(TWO, CURVES, True),
        runs_figure(TWO, True, 0.005),
        gravity_figure(fake_analysis.gravity(), True, 9.82),
    ]


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


def test_svg_is_well_formed_and_repeats() -> None:
    first, second = all_three(), all_three()
    assert first == second
    for svg in first:
        assert ElementTree.fromstring(svg).tag.endswith("svg")
        assert "<!-- SIMULATED DATA -->" in svg
        assert "dc:date" not in svg


def test_every_colour_has_its_counterpart_on_a_dark_page() -> None:
    drawn = [picture.svg for picture in pictures(TWO, CURVES, True, sections=Sections())]
    known = re.findall(r"(?:fill|stroke): (#[0-9a-f]{6})\"", dark_figure_css())
    # Markers are drawn through <use>, where rules that name what is around them do not reach.
    assert all(line.startswith(("[style", "@", "}")) for line in dark_figure_css().splitlines())
    for svg in [*all_three(), *drawn]:
        used = set(re.findall(r"(?:fill|stroke): (#[0-9a-f]{6})", svg))
        assert used - set(PARTS) <= set(known)
        assert f"fill: {PAPER}" in svg  # a ground of its own


def test_bars_of_residuals_are_u_of_the_difference() -> None:
    """One uncertainty, which holds the model's and the falls' scatter: no second bar beside it."""
    drawn = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Canvas, "svg", property(lambda self: drawn.append(self) or ""))
        incline_figure(TWO, CURVES)
    bars = [one for one in drawn[0].axes[1].containers if one.has_yerr]
    (segments,) = [bar.get_segments() for bar in bars[0].lines[2]]
    lengths = [(end[1] - begin[1]) / 2.0 for begin, end in segments]
    differences = [line.differences["separation_m"] for line in TWO.summary]
    assert len(bars) == 1
    assert lengths == pytest.approx([1e3 * one.expanded for one in differences])


def test_where_the_model_has_no_answer_is_hatched() -> None:
    gap = {**CURVES, "incline_deg": [0.0, 12.0, *CURVES["incline_deg"][2:]]}
    assert "model has no answer" in incline_figure(TWO, gap)
    (first, *_) = pictures(TWO, gap, sections=Sections())
    assert "arctan μ" in first.caption


def test_the_stamp_is_for_simulated_data_only() -> None:
    assert "SIMULATED" not in incline_figure(TWO, CURVES, False)


def test_words_beside_colours() -> None:
    svg = incline_figure(TWO, CURVES)
    for words in ("rods on the surface", "rods on a pile", "single runs", "mean of runs"):
        assert words in svg
    assert "free fall, 5.14 m/s" in svg
    svg = runs_figure(TWO, skew_limit_s=0.005)
    for words in ("chain A strikes", "chain B strikes", "limit ±5 ms", "void"):
        assert words in svg


def test_what_is_missing_is_left_out() -> None:
    svg = runs_figure(fake_analysis.single_chain())
    assert "skew" not in svg
    assert "free fall" not in incline_figure(TWO, None)
    assert "site" not in gravity_figure(replace(fake_analysis.gravity(), summary=()))


@pytest.mark.parametrize("figure", [incline_figure, runs_figure, gravity_figure])
def test_nothing_measured(figure) -> None:
    void = DropResult(Run(1, 40.0, "A", "B"), 1, "void", (), Audit(0, 0, 50, 0, 0))
    for analysis in (fake_analysis.EMPTY, fake_analysis.analysis([void], [])):
        ElementTree.fromstring(figure(analysis))


def test_a_void_run_does_not_set_the_scale() -> None:
    runs = list(TWO.runs)
    number = next(i for i, run in enumerate(runs) if run.verdict == "void")
    runs[number] = fake_analysis.measured(runs[number], separation_m=Measured(9.0, 0.001))
    assert "(1 off the scale)" in runs_figure(replace(TWO, runs=tuple(runs)))


def test_without_a_prediction_the_mean_takes_its_place() -> None:
    bare = [replace(line, predicted={}) for line in TWO.summary]
    assert "− mean (cm)" in runs_figure(replace(TWO, summary=tuple(bare)))


def test_pictures_follow_the_scene() -> None:
    drawn = pictures(TWO, CURVES, sections=Sections())
    assert [one.place for one in drawn] == ["results", "drops", "budget"]
    assert [picture.alt for picture in pictures(fake_analysis.gravity(), sections=Sections())] == [
        "Acceleration of each run"
    ]
    first = next(one for one in TWO.runs if one.verdict == "accepted")
    films = {(one.run.number, one.attempt): FILM for one in TWO.runs}
    fell, lost = pictures(TWO, CURVES, films=films, sections=Sections())[2:4]
    assert fell.alt == f"How run {first.run.number} fell"
    void = next(one for one in TWO.runs if one.verdict == "void")
    assert f"Run {void.run.number} (void), simulated at " in lost.caption
    assert pictures(fake_analysis.EMPTY, sections=Sections()) == []
    picture, _ = pictures(fake_analysis.single_chain(), sections=Sections())
    assert "eparation" not in picture.alt + picture.caption


def test_slack_strings_are_drawn_apart() -> None:
    loose = film_figure(FILM)
    tight = film_figure(replace(FILM, rest_m=[[0.05], [0.09]]))
    assert tight.count(SECOND) < loose.count(SECOND)
