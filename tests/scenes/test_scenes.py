"""Any scene, any command: it ends, says what is true, and leaves out what is not there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.scenes.draw import scene
from tests.scenes.through import faults

if TYPE_CHECKING:
    from pathlib import Path

    from tests.scenes.draw import Scene

FEW = 32
MANY = 240
LONG = 24
"""A scene in which every drop is void, and each command seeks the causes anew."""


def _assert_sound(drawn: Scene, folder: Path) -> None:
    found = faults(drawn, folder)
    assert not found, "\n".join([drawn.port, drawn.text, *found])


@pytest.mark.parametrize("seed", [seed for seed in range(FEW) if seed != LONG])
def test_a_scene_goes_through_every_command(seed, tmp_path):
    _assert_sound(scene(seed), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [LONG, *range(FEW, MANY)])
def test_many_more_scenes_go_through_every_command(seed, tmp_path):
    _assert_sound(scene(seed, drops=12), tmp_path)
