"""The table of extremes: every scene is exact, noted or refused, and the verdicts can fail."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal

import pytest

from rig.bench import stability as bench
from rig.bench.extremes import PAPER, Extreme, extremes
from rig.model.fall import Fall

SMALL = [scene for scene in extremes() if scene.chain.rods <= 10_000]


@pytest.mark.parametrize("scene", SMALL, ids=lambda scene: f"{scene.group} {scene.value}")
def test_no_scene_fails(scene):
    row = bench.examine(scene)
    assert row.verdict in {"exact", "noted", "refused"}, row
    # Whatever is not simply right says why.
    assert (row.verdict == "exact") == (row.note == "")


def test_a_wrong_digit_is_seen(monkeypatch):
    right = bench.fall

    def wrong(*scene: float) -> Fall:
        found = right(*scene)
        return replace(found, separation_m=found.separation_m * (1 + 1e-12))

    monkeypatch.setattr(bench, "fall", wrong)
    assert bench.examine(Extreme("none", "as in the paper", PAPER)).verdict == "FAILED"


@pytest.mark.parametrize(("found", "exact", "error"), [
    (1.0, "1", 0.0),
    (1.0, "2", 0.5),
    (float("nan"), "1", float("inf")),
    (float("inf"), "1", float("inf")),
    (1e-320, "1.00001e-320", 0.0),  # no float is nearer
    (1.0, "0", float("inf")),
])  # fmt: skip
def test_relative_error(found, exact, error):
    assert bench.relative_error(found, Decimal(exact)) == error


def test_the_shortest_supersonic_chain_is_the_shortest():
    for one in bench.sonic_lengths([0.5, 0.3]):
        end = bench._end_speed(one.ratio, one.rods)
        shorter = bench._end_speed(one.ratio, one.rods - 1)
        assert shorter < bench.SOUND <= end
