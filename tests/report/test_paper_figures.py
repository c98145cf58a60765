"""The paper's figures come out whole, the same every time, with the disagreements below."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ET

import pytest

from rig import cli


@pytest.mark.parametrize(("number", "own", "other"), [
    (3, "friction raises", "Eq. 15 within"), (6, "Eq. 15 within", "friction raises"),
    (4, "graded chain", "Eq. 15 within"),
])  # fmt: skip
def test_a_figure_its_numbers_and_its_caption(number, own, other, tmp_path):
    target = tmp_path / "figure.svg"
    assert cli.main(["predict", "--figure", str(number), "-o", str(target)]) == 0
    caption = " ".join("".join(ET.parse(target).getroot().itertext()).split())
    assert own in caption
    assert other not in caption
    with target.with_suffix(".csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) > 20
    assert all(float(value) == float(value) for row in rows for value in row.values())
