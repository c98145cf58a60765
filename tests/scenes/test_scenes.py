"""Any scene, any command: it ends, says what is true, and leaves out what is not there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.scenes.draw import scene
from tests.scenes.through import faults

if TYPE_CHECKING:
    from pathlib import Path

    from tests.scenes.draw import Scene

pytestmark = pytest.mark.usefixtures("analysed_once")
DEAR = (18, 23, 24, 56)
"""Scenes that take several times as long as others."""
FALLING = (63, 75, 85, 110)
"""Further scenes without a chain, of which the first 60 have few: an object, a track, fences."""
SOME = [seed for seed in (*range(60), *FALLING) if seed not in DEAR]
MANY = 240


def _assert_sound(drawn: Scene, folder: Path) -> None:
    found = faults(drawn, folder)
    assert not found, "\n".join([drawn.port, drawn.text, *found])


@pytest.mark.parametrize("seed", SOME)
def test_a_scene_goes_through_every_command(seed, tmp_path):
    _assert_sound(scene(seed), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [seed for seed in range(MANY) if seed not in SOME])
def test_many_more_scenes_go_through_every_command(seed, tmp_path):
    _assert_sound(scene(seed, drops=12), tmp_path)
