"""Figures are plain data; drawn, they are whole, the same each time, and hide nothing."""

import csv
import io
import math
import signal
from dataclasses import replace
from itertools import combinations
from xml.etree import ElementTree as ET

import pytest

from rig import cli
from rig.analysis.curves import model_curves
from rig.analysis.result import Measured
from rig.measurands import SEPARATION
from rig.predictions import predict_incline
from rig.protocol import reader
from rig.protocol.protocol import Run
from rig.protocol.reader import parse, read
from rig.report.canvas import KINDS, figure_file, write_figures
from rig.report.falls import fall_figures
from rig.report.figure import COLUMN_PT, WIDE_PT, Chart, PlotAxis, csv_table, residual_panels
from rig.report.figures import (
    _stack_bar,
    budget_figure,
    result_figure,
    runs_figure,
    variance_shares,
)
from rig.report.looks import COLORS, PARTS
from rig.report.mounting import beam_ends, mounting_figure
from rig.report.plot import drawing_file, page_svg, plot, style
from sim.dials import Dials
from tests.analysis.drops import PROTOCOLS, UNIFORM, case, made_up
from tests.analysis.test_datum_board import BOARD_GRADED
from tests.refusals import refused
from tests.report import fake_analysis
from tests.tables import cases

TWO = fake_analysis.two_chains()
CURVES = model_curves(UNIFORM)


def figures() -> list[Chart]:
    """One of each kind, of made-up results."""
    mean = Measured(0.1, 5**0.5 * 1e-3, budget={"runs": 1e-3, "common": 2e-3})
    causes = {"separation_m": {"datum": 4e-3, "beam heights": 3e-3, "width": 1e-5}}
    line = replace(TWO.summary[0], means={"separation_m": mean}, causes=causes)
    return [
        result_figure(TWO, CURVES),
        result_figure(fake_analysis.gravity(), {}),
        runs_figure(TWO, 0.005),
        budget_figure([line]),
    ]


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.title)
@pytest.mark.parametrize(("kind", "width"), [("slim", COLUMN_PT), ("wide", WIDE_PT)])
def test_a_figure_is_drawn_whole(figure, kind, width):
    svg = page_svg(replace(figure, simulated=True), width, kind)
    root = ET.fromstring(svg)
    assert root.get("class") == kind
    assert float(root.get("viewBox").split()[2]) == width
    shown = {(node.text or "").strip() for node in root.iter() if node.tag.endswith("text")}
    assert "SIMULATED DATA" in shown
    for panel in figure.panels:
        labels = {trace.label for trace in panel.series} | set(panel.y.label.split("\n"))
        assert labels - {""} <= shown
    assert not any(light in svg for light, _ in COLORS), "a dark page has other colours"


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.title)
def test_names_of_series_hide_no_other_and_stay_inside(figure):
    drawing = plot(figure)
    for panel, axes in zip(figure.panels, drawing.axes, strict=True):
        names = {trace.label for trace in panel.series} - {""}
        texts = [text for text in axes.texts if text.get_text() in names]
        assert {text.get_text() for text in texts} == names
        boxes = [(text, text.get_window_extent()) for text in texts]
        for (text, box), (other, beside) in combinations(boxes, 2):
            assert not box.padded(-1.0).overlaps(beside.padded(-1.0)), (text, other)
        for text, box in boxes:
            assert box.x0 >= 0.0, text
            assert box.x1 <= drawing.bbox.x1 + 1.0, text


def test_every_number_of_a_figure_is_in_its_table(tmp_path):
    figure = result_figure(TWO, CURVES)
    rows = list(csv.DictReader(io.StringIO(csv_table(figure))))
    means = [row for row in rows if row["series"] == "means" and row["panel"] == "1"]
    expected = [100.0 * line.means["separation_m"].expanded for line in TWO.summary]
    assert [float(row["U95"]) for row in means] == expected
    write_figures(tmp_path, [figure])
    names = {f"figure-1.{kind}" for kind in (*KINDS, "csv")}
    assert {path.name for path in tmp_path.iterdir()} == names
    for kind in KINDS:
        assert (tmp_path / f"figure-1.{kind}").read_bytes() == figure_file(figure, kind)


def test_without_any_uncertainty_there_are_no_residuals():
    """A protocol may state heights as exact."""
    axis, none = PlotAxis("time (s)"), [(0.1, float("inf")), (0.2, float("nan"))]
    assert not residual_panels(axis, none)
    assert residual_panels(axis, [(0.1, 0.5), *none])


def test_figures_follow_the_scene():
    assert runs_figure(fake_analysis.gravity()) is None
    gravity = result_figure(fake_analysis.gravity(), {})
    assert [panel.x.label for panel in gravity.panels] == ["run"]
    void = made_up(Run(1, 40.0, "A", "B"), "void")
    for analysis in (fake_analysis.EMPTY, fake_analysis.analysis([void], [])):
        assert result_figure(analysis, CURVES) is None
        assert runs_figure(analysis) is None
        assert budget_figure(analysis.summary) is None


def test_a_void_run_does_not_set_the_scale():
    runs = list(TWO.runs)
    number = next(i for i, run in enumerate(runs) if run.verdict == "void")
    runs[number] = fake_analysis.measured(runs[number], separation_m=Measured(9.0, 0.001))

    def numbers(runs):
        return [axes.get_ylim() for axes in plot(runs_figure(replace(TWO, runs=tuple(runs)))).axes]

    assert numbers(runs) == numbers(TWO.runs)


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_ctrl_c_waits_until_a_figure_is_drawn_and_until_it_is_written(kind, monkeypatch) -> None:
    """From matplotlib's C++ an exception would end the process, without a word."""
    drawings = []

    def drawn() -> None:
        with style():
            signal.raise_signal(signal.SIGINT)
            drawings.append(plot(runs_figure(TWO, 0.005)))

    refused(KeyboardInterrupt, "", drawn)
    (drawing,) = drawings
    write = drawing.draw

    def struck(renderer) -> None:
        signal.raise_signal(signal.SIGINT)
        write(renderer)
        drawings.append(drawing)

    monkeypatch.setattr(drawing, "draw", struck)
    refused(KeyboardInterrupt, "", drawing_file, drawing, kind)
    assert len(drawings) > 1


AIR = reader.parse(f"{UNIFORM.text}drag: {{terminal_speed: 15 m/s}}\n")


@pytest.mark.parametrize("name", ["falling-ball", "glider", "picket-fence"])
def test_points_of_a_perfect_fall_lie_on_its_line(name):
    """A glider's card is in a beam for a third of a second, and speeds up meanwhile."""
    drop = case(reader.read(PROTOCOLS / f"{name}.yaml"), Dials.quiet(), run=1)
    (figure,) = fall_figures(drop.protocol, (drop.drop, drop.scale.hz, drop.analyze()))
    panels = [panel for panel in figure.panels if panel.y.label.startswith("residual")]
    assert [len(panel.series[-1].y) >= 4 for panel in panels] == [True, True]
    assert all(abs(ratio) < 0.2 for panel in panels for ratio in panel.series[-1].y)


@pytest.mark.parametrize(("protocol", "run"), [(AIR, 25), (BOARD_GRADED, 1)], ids=["air", "board"])
def test_points_of_a_perfect_separation_lie_on_the_models_line(protocol, run):
    """The line falls in the stated air, and heights count from where the top rod touches."""
    drop = case(protocol, Dials.quiet(), run=run)
    figure, speeds = fall_figures(drop.protocol, (drop.drop, drop.scale.hz, drop.analyze()))
    residuals = figure.panels[-1].series[-1].y
    assert len(residuals) > 100
    assert max(map(abs, residuals)) < 0.2
    free_fall, model, *_ = speeds.panels[0].series
    assert free_fall.y[-1] == model.y[-1] == 0.0
    stated = predict_incline(protocol, drop.run.incline_deg, "A")
    assert model.x[-1] == pytest.approx(stated.speed_m_s**2)
    assert free_fall.x[-1] == pytest.approx(stated.free_fall_speed_m_s**2)


@cases
def test_a_figure_has_its_own_caption(number, own, other, tmp_path):
    target = tmp_path / "figure.svg"
    assert cli.main(["predict", "--figure", str(number), "-o", str(target)]) == 0
    caption = " ".join("".join(ET.parse(target).getroot().itertext()).split())
    assert own in caption
    assert other not in caption


def test_shares_of_a_variance_add_up_to_the_whole():
    (line,) = [line for line in TWO.summary if line.condition.incline_deg == 40.0]
    mean = Measured(0.1, 5e-3, budget={"runs": 3e-3, "common": 4e-3})
    line = replace(line, means={"separation_m": mean}, causes={"separation_m": {"datum": 4e-3}})
    assert variance_shares([line], SEPARATION) == pytest.approx({"runs": 36.0, "datum": 64.0})


def test_sources_beyond_the_colours_are_among_the_others():
    colors: dict[str, int] = {}
    for names in ("abcdefgh", "abc", "hgfedcba"):
        bars = [*_stack_bar(dict.fromkeys(names, 100.0 / len(names)), colors)]
        shares = [end - begin for bar in bars for end, _, begin in bar["points"]]
        assert sum(shares) == pytest.approx(100.0)
        assert len({bar["color"] for bar in bars}) == len(bars)
    assert len(colors) == len(PARTS)


READY = [
    path
    for path in sorted(PROTOCOLS.glob("*.yaml"))
    if "\ngates:" in path.read_text("utf-8") and "uno" not in path.stem  # as its like, with fewer
]


def drawn(protocol):
    return figure_file(mounting_figure(protocol), "svg").decode()


@pytest.mark.parametrize("path", READY, ids=lambda path: path.stem)
def test_each_ready_protocol_has_its_drawing(path):
    protocol = read(path)
    said = "".join(ET.fromstring(drawn(protocol)).itertext()).split("\n")
    said = {words.strip() for words in said}
    assert {f"{gate.channel}: {1e3 * gate.height:g}" for gate in protocol.gates.gates} <= said
    inclines = {incline for incline in protocol.plan.inclines if protocol.surface is not None}
    assert {f"{incline:g}°" for incline in inclines} <= said


def test_a_beam_ends_where_the_face_is_that_a_rod_lies_on():
    protocol = read(PROTOCOLS / "single-chain.yaml")
    slope, radius = math.radians(40), 12.7e-3 / 2
    uphill, along = beam_ends(protocol, 22e-3, 40)
    # The face is the line at a rod's radius from the contact point.
    assert -uphill * math.sin(slope) + 22e-3 * math.cos(slope) == pytest.approx(-radius, abs=1e-12)
    assert along * math.cos(slope) == pytest.approx(uphill)
    assert beam_ends(protocol, 22e-3, 80)[0] < uphill


def test_from_the_board_heights_are_those_above_its_face():
    text = (PROTOCOLS / "single-chain.yaml").read_text("utf-8").replace("22 mm", "40 mm")
    protocol = parse(f"{text}\ncontact: {{datum: board}}\n")
    uphill, _ = beam_ends(protocol, 40e-3, 40)
    assert uphill == pytest.approx(40e-3 / math.tan(math.radians(40)))
    svg = drawn(protocol)
    assert "mm above the board" in svg
    assert "contact point" not in svg
