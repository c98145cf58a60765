"""The paper's figures come out whole, the same every time, with the disagreements below."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ET

import pytest

from rig import cli
from rig.report import paper as figures


@pytest.mark.parametrize("number", [3, 4, 6])
def test_a_figure_and_its_numbers(number, tmp_path):
    target = tmp_path / "figure.svg"
    assert cli.main(["predict", "--figure", str(number), "-o", str(target)]) == 0
    ET.fromstring(target.read_text(encoding="utf-8"))
    with target.with_suffix(".csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) > 20
    assert all(float(value) == float(value) for row in rows for value in row.values())


@pytest.mark.parametrize(("number", "own", "other"), [
    (3, "friction raises", "Eq. 15 within"), (6, "Eq. 15 within", "friction raises"),
    (4, "graded chain", "Eq. 15 within"),
])  # fmt: skip
def test_a_caption_is_of_its_own_figure(number, own, other):
    svg = " ".join(figures.paper_figure(number)[0].foot)
    assert own in svg
    assert other not in svg


@pytest.mark.parametrize("arguments", [
    ["predict", "--figure", "3"],
    ["predict", "--figure", "3", "-o", "figure.doc"],
    ["predict"],
])  # fmt: skip
def test_what_is_missing_is_said(arguments, capsys):
    assert cli.main(arguments) == 2
    assert ".svg" in capsys.readouterr().err
