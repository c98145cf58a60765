"""Figures are well-formed, repeat byte for byte, and survive what is missing."""

import copy
from xml.etree import ElementTree

import pytest

from rig.report.figures import gravity_figure, incline_figure, runs_figure
from rig.report.pictures import pictures
from rig.sections import Sections
from tests.report import fake_analysis

TWO = fake_analysis.two_chains()
CURVES = fake_analysis.curves()


def all_three() -> list[str]:
    return [
        incline_figure(TWO, CURVES, True),
        runs_figure(TWO, True, 0.005),
        gravity_figure(fake_analysis.gravity(), True, {"value": 9.82, "u": 0.0, "U95": 0.0}),
    ]


def test_svg_is_well_formed_and_repeats() -> None:
    first, second = all_three(), all_three()
    assert first == second
    for svg in first:
        assert ElementTree.fromstring(svg).tag.endswith("svg")
        assert "<!-- SIMULATED DATA -->" in svg
        assert "dc:date" not in svg


def test_the_stamp_is_for_simulated_data_only() -> None:
    assert "SIMULATED" not in incline_figure(TWO, CURVES, False)


def test_words_beside_colours() -> None:
    svg = incline_figure(TWO, CURVES)
    for words in ("rods on the surface", "rods on a pile", "single runs", "mean of runs"):
        assert words in svg
    assert "free fall, 5.14 m/s" in svg
    svg = runs_figure(TWO, skew_limit_s=0.005)
    for words in ("chain A on the surface", "chain B on the surface", "limit ±5 ms", "void"):
        assert words in svg


def test_what_is_missing_is_left_out() -> None:
    svg = runs_figure(fake_analysis.single_chain())
    assert "skew" not in svg
    assert "free fall" not in incline_figure(TWO, None)
    assert "site" not in gravity_figure({"runs": fake_analysis.gravity()["runs"], "summary": []})


@pytest.mark.parametrize("figure", [incline_figure, runs_figure, gravity_figure])
def test_nothing_measured(figure) -> None:
    void = {"run": 1, "incline_deg": 40.0, "separation_m": None, "verdict": "void", "reasons": []}
    for analysis in ({}, {"runs": [], "summary": []}, {"runs": [void], "summary": []}):
        ElementTree.fromstring(figure(analysis))


def test_a_void_run_does_not_set_the_scale() -> None:
    wild = copy.deepcopy(TWO)
    number = next(i for i, run in enumerate(wild["runs"]) if run["verdict"] == "void")
    wild["runs"][number]["separation_m"]["value"] = 9.0
    assert "(1 off the scale)" in runs_figure(wild)


def test_without_a_prediction_the_mean_takes_its_place() -> None:
    bare = copy.deepcopy(TWO)
    for line in bare["summary"]:
        del line["predicted"]
    assert "− mean (cm)" in runs_figure(bare)


def test_pictures_follow_the_scene() -> None:
    assert len(pictures(TWO, CURVES, sections=Sections())) == 2
    assert [picture.alt for picture in pictures(fake_analysis.gravity(), sections=Sections())] == [
        "Acceleration of each run"
    ]
    assert pictures({"runs": [], "summary": []}, sections=Sections()) == []
    single = fake_analysis.two_chains()
    for line in (*single["runs"], *single["summary"]):
        line.pop("separation_m", None)
    (picture,) = pictures(single, sections=Sections())
    assert "eparation" not in picture.alt + picture.caption
