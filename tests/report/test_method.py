"""What a report says of its method and of whom to cite."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import yaml

from rig import __version__
from rig.report.method import METHOD, PAPER, SOFTWARE, method_page, method_words
from tests.report import fake_analysis

ROOT = Path(__file__).parents[2]


def test_page_and_citation_file_name_the_same():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert cited["version"] == __version__
    assert __version__ in SOFTWARE
    assert cited["title"].partition(":")[2].strip() in SOFTWARE
    (paper,) = cited["references"]
    assert paper["title"] in PAPER
    assert paper["identifiers"][0]["value"] in PAPER


def test_the_method_speaks_of_what_there_is():
    first, second = method_words(fake_analysis.two_chains())
    assert "Eq. 9" in first
    assert "simultaneous release" in first
    assert second.startswith("Each drop was fitted alone")
    first, _ = method_words(fake_analysis.gravity())
    assert not re.search("Eq. 9|simultaneous", first)
    together = replace(fake_analysis.two_chains(), rig=object())
    assert method_words(together)[1].startswith("All good drops were fitted together")


def test_the_method_travels_with_the_program():
    assert method_page() == (ROOT / "docs" / METHOD).read_text("utf-8")
