"""Rods that lie where others strike: drops of the resolved world on flat boards."""

import json
from dataclasses import replace

import numpy as np
import pytest

from bench.studies.falls import Asked, falls
from bench.studies.layout_catalogue import Kind, graded, under
from bench.studies.time_scales import time_scale
from rig.analysis.components import Components
from rig.analysis.drop import DropCase
from rig.protocol import reader
from tests.analysis.drops import PROTOCOLS, UNIFORM, codes

pytestmark = pytest.mark.usefixtures("loops_compiled")

SEEDS = (3, 4)
HELD = "separation_m", "separation_strike_m", "speed_m_s", "release_skew_s"
RUNS = {run.number: run for run in UNIFORM.runs()}


@pytest.fixture(scope="module")
def piled():
    """Drops of the resolved world on two rigs, and what is true of them."""
    first = {run.incline_deg: number for number, run in reversed(RUNS.items())}
    url = f"sim://?dynamics=resolved&stated=1&protocol={PROTOCOLS / 'inclined-uniform.yaml'}"
    drops = falls([Asked(url, SEEDS, [[first[incline] for incline in (0.0, 20.0)]] * len(SEEDS))])
    return [
        (DropCase(UNIFORM, RUNS[fall.drop.run], fall.drop, time_scale(fall.seed)), fall)
        for fall in drops
    ]


def test_drops_on_a_pile_are_read_without_the_beams_in_it(piled):
    for case, fall in piled:
        result, _ = case.read()
        assert codes(result) == ["low_gates_miss_rods"]
        assert fall.rods(result.matches)[0] == 0
        for name in HELD:
            measured = result.quantities[name]
            assert abs(measured.value - fall.truth[name]) < 2.0 * measured.expanded, name


def test_rods_that_a_heap_hides_from_low_beams_are_not_taken_for_absent(tmp_path):
    path, thick_above = tmp_path / "graded.yaml", Kind("", graded((6, 9, 14, 20, 28), 1200))
    path.write_text(under(thick_above, (0.2, 0.5), (0.18, 0.55)).protocol())
    protocol = reader.read(path)
    url = f"sim://?dynamics=resolved&stated=1&protocol={path}"
    for fall in falls([Asked(url, (1, 3), [[1], [4]])]):
        run = protocol.runs()[fall.drop.run - 1]
        result, _ = DropCase(protocol, run, fall.drop, time_scale(fall.seed)).read()
        speed = result.quantities["speed_m_s"]
        assert "rod_count" not in codes(result)
        assert abs(speed.value - fall.truth["speed_m_s"]) < speed.expanded


def test_what_was_found_of_it_is_kept_for_the_next_time(piled):
    case, _ = piled[0]
    first = case.summary()
    assert first.aside
    again = case.summary(first)
    assert json.dumps(again.result.json()) == json.dumps(first.result.json())
    assert case.restore_drop(first).rods_of(len(first.result.rods)) == first.result.rods


def test_no_impulse_scatters_by_more_than_its_whole_range():
    """Single impulses of ±3 on a pile, which no energy allows, made V uncertain by itself."""
    wild = Components(impulse=30.0, impulse_floor=3.0, bounce=100.0)
    assert wild.impulses(0.1, np.array([1.0, 2.0, 24.0])) == pytest.approx([0.7 / 12**0.5] * 3)


def test_a_gate_below_the_surface_expects_no_edge_and_breaks_nothing(piled):
    case, _ = piled[0]
    gates = (replace(gate, height=-0.05) for gate in UNIFORM.gates.gates)
    result, fit = replace(case, protocol=UNIFORM.with_gates(gates)).read(explain=False)
    assert (result.verdict, fit) == ("void", None)
