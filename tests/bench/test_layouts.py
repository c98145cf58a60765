"""Layouts of gates: that all are protocols, and that void and wrong are counted by the truth."""

import json

import pytest

from bench.__main__ import main
from bench.studies.layout_catalogue import LAYOUTS
from bench.studies.layouts import DISTURBANCES
from rig.protocol.measurable import unmeasurable
from rig.protocol.reader import parse


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda one: f"{one.kind.name}: {one.heights}")
def test_every_layout_is_a_protocol_that_can_be_measured(layout):
    protocol = parse(layout.protocol())
    assert not unmeasurable(protocol)
    assert len(protocol.gates.gates) == len(layout.impact) + len(layout.free)
    assert (protocol.surface is None) == (layout.kind.scene == "fence")
    assert protocol.two_chains == (layout.kind.scene == "two")


def test_the_bench_keeps_table_and_page(tmp_path, capsys):
    arguments = ["layouts", "-o", str(tmp_path), "--only", "3 rods: 2 + 2"]
    assert main([*arguments, "--drops", "2", "--jobs", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["disturbance"] for one in found["layouts"]] == [*DISTURBANCES]
    for one in found["layouts"]:
        assert (one["drops"], one["wrong_edges"]) == (2, 0)
    quiet = found["layouts"][0]
    assert (quiet["void_share"], quiet["beyond"]) == (0.0, 0)
    assert quiet["error_rms"] < 1e-5
    assert (tmp_path / "layouts.csv").read_text("utf-8").count("3 rods,") == 3
    page = (tmp_path / "layouts.md").read_text("utf-8")
    assert "36, 117 + 32.4, 108" in page
    assert "bench layouts --drops 2`" in page
