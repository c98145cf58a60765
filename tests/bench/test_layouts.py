"""Layouts of gates: that all are protocols, and that void and wrong are counted by the truth."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict, replace

import pytest

from bench.__main__ import main
from bench.studies.layout_catalogue import LAYOUTS
from bench.studies.layouts import DISTURBANCES, Cell, as_json
from rig.bench.falls import SimulatedDrop
from rig.protocol.measurable import unmeasurable
from rig.protocol.reader import parse
from rig.reasons import make_reason
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda one: f"{one.kind.name}: {one.heights}")
def test_every_layout_is_a_protocol_that_can_be_measured(layout):
    protocol = parse(layout.protocol())
    assert not unmeasurable(protocol)
    assert len(protocol.gates.gates) == len(layout.impact) + len(layout.free)
    assert (protocol.surface is None) == (layout.kind.scene == "fence")
    assert protocol.two_chains == (layout.kind.scene == "two")


def judged(change=lambda result: result, dials=None, drop=lambda one: one):
    """One drop of the standard rig in a cell of its own."""
    one = drop(case(UNIFORM, dials or Dials.quiet(), incline=40.0))
    cell = Cell("25 rods", "8 + 8", "", "quiet")
    cell.add(UNIFORM, SimulatedDrop(1, one.drop, asdict(one.truth)), change(one.analyze()), 0.01)
    return cell


def shifted(result):
    """Every edge of a rod given to the next one."""
    return replace(result, matches={n: rod + 1 for n, rod in result.matches.items()})


def test_a_wrong_rod_is_counted_and_a_right_one_is_not():
    right, wrong = judged(), judged(shifted)
    assert (right.wrong, right.wrong_edges) == (0, 0)
    assert right.edges == len(case(UNIFORM, Dials.quiet(), incline=40.0).drop.edges)
    assert (wrong.wrong, wrong.wrong_edges) == (1, wrong.edges)
    (total, *_) = as_json([right, wrong])["totals"]
    assert (total["wrong"], total["drops"], total["void_share"]) == (1, 2, 0.0)


MISSED = make_reason("edges_missed", missed=12, expected=30, limit=0.05)


def test_a_void_drop_is_counted_with_its_reason_and_no_number():
    cell = judged(lambda found: replace(found, verdict="void", reasons=(MISSED,)))
    assert cell.json()["void_share"] == 1.0
    assert cell.json()["reasons"] == {"edges_missed": 1}
    assert cell.json()["z_rms"] is None


def test_a_drop_that_truly_is_beyond_the_limits_does_not_count():
    worse = Dials(**(asdict(Dials.quiet()) | {"missed": 0.3}))
    cell = judged(dials=worse)
    assert (cell.drops, cell.beyond, cell.verdicts.total()) == (1, 1, 0)


def test_the_bench_keeps_table_map_and_page(tmp_path, capsys):
    arguments = ["layouts", "-o", str(tmp_path), "--only", "3 rods: 2 + 2"]
    assert main([*arguments, "--drops", "1", "--jobs", "1", "--json"]) == 0
    one = json.loads(capsys.readouterr().out)
    assert main([*arguments, "--drops", "1", "--more", "--jobs", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    # A second rig is another one: what the first has left is still there.
    for less, more in zip(one["layouts"], found["layouts"], strict=True):
        assert less["edges"] < more["edges"]
        assert less["sums"]["errors"] < more["sums"]["errors"]
    assert [one["disturbance"] for one in found["layouts"]] == [*DISTURBANCES]
    for one in found["layouts"]:
        assert (one["drops"], one["wrong_edges"]) == (2, 0)
        assert sum(one["verdicts"].values()) + one["beyond"] == 2
    quiet = found["layouts"][0]
    assert (quiet["void_share"], quiet["beyond"]) == (0.0, 0)
    assert quiet["error_rms"] < 1e-5
    assert quiet["times_lstsq"] > 1.0  # one plain solution is part of any adjustment
    rows = list(csv.DictReader((tmp_path / "layouts.csv").read_text("utf-8").splitlines()))
    assert [row["chain"] for row in rows] == ["3 rods"] * 3
    assert "SIMULATED" in (tmp_path / "layouts.svg").read_text("utf-8")
    page = (tmp_path / "layouts.md").read_text("utf-8")
    assert "36, 117 + 32.4, 108" in page
    assert "bench layouts --drops 2`" in page


@pytest.mark.parametrize("text", [None, "", "{}", '{"layouts": [{"chain": "3 rods"}]}'])
def test_what_is_no_result_of_this_bench_cannot_be_added_to(tmp_path, capsys, text):
    if text is not None:
        (tmp_path / "layouts.json").write_text(text)
    assert main(["layouts", "-o", str(tmp_path), "--more"]) == 2
    why = "No such file or directory" if text is None else "it is not what this bench leaves"
    assert f"cannot add to {tmp_path / 'layouts.json'}: {why}\n" in capsys.readouterr().err
