"""Rigs that are wrong in one thing: that they are rigs, and how what is said of them is counted."""

import json

from bench.__main__ import main
from bench.studies.diagnoses import LAYOUTS, NONE, OUTCOMES
from bench.studies.wrong_rigs import WRONG_RIGS
from rig.protocol.reader import parse

ONE_OF_A_KIND = LAYOUTS[0], *LAYOUTS[7:]
"""Two chains alike and unlike, a single one, a fence: what other layouts add are gates."""


def test_every_fault_is_of_some_layout_and_another_rig_than_the_stated_one():
    for fault in WRONG_RIGS:
        every = [(one, [*fault.rigs(one.protocol())]) for one in ONE_OF_A_KIND]
        # Each layout's smallest and largest fault: what lies between is made alike.
        rigs = [(one, rig) for one, sizes in every for rig in (*sizes[:1], *sizes[1:][-1:])]
        assert rigs, fault.name
        for layout, (size, text) in rigs:
            assert parse(text).gates is not None
            otherwise = fault.settings(size) or fault.slow(size)
            assert otherwise or json.loads(text) != json.loads(layout.protocol())


def test_the_bench_keeps_table_and_page(tmp_path, capsys):
    arguments = ["diagnoses", "-o", str(tmp_path), "--only", "fence", "--drops", "1"]
    assert main([*arguments, "--clean", "2", "--jobs", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["diagnoses"]
    assert all(sum(one[name] for name in OUTCOMES) in (1, 2) for one in found)
    assert sum(one["wrong"] for one in found) == 0
    (clean,) = (one for one in found if one["fault"] == NONE)
    assert clean["unnoticed"] + clean["unnamed"] == 2
    assert "chain stretched" in (tmp_path / "diagnoses.md").read_text("utf-8")
    assert len((tmp_path / "diagnoses.csv").read_text("utf-8").splitlines()) == 1 + len(found)
