"""Any scene, any command: it ends, says what is true, and leaves out what is not there."""

from pathlib import Path

import pytest

from tests.scenes.draw import Scene, scene
from tests.scenes.through import faults

pytestmark = pytest.mark.usefixtures("analysed_once")
SOME = (0, 2, 13, 20, 39, 46, 57, 62, 67, 93, 107, 128, 204, 218, 223)
"""The quickest scenes in which, together, each thing occurs that `draw` has a choice of."""
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
