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


def test_figures_are_byte_for_byte_the_same():
    assert figures.paper_figure(4) == figures.paper_figure(4)


@pytest.mark.parametrize("arguments", [
    ["predict", "--figure", "3"],
    ["predict", "--figure", "3", "-o", "figure.pdf"],
    ["predict"],
])  # fmt: skip
def test_what_is_missing_is_said(arguments, capsys):
    assert cli.main(arguments) == 2
    assert "-o FILE.svg" in capsys.readouterr().err
