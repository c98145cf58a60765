"""The table of extremes: every scene is exact, noted or refused, and the verdicts can fail."""

from dataclasses import replace

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
