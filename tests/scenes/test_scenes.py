"""Any scene, any command: it ends, says what is true, and leaves out what is not there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rig.commands import design
from rig.design.trials import trials
from tests.scenes.draw import scene
from tests.scenes.through import faults

if TYPE_CHECKING:
    from pathlib import Path

    from tests.scenes.draw import Scene

SOME = (0, 1, 4, 6, 7, 8, 9, 10, 12, 13, 14, 15, 16, 20, 21, 22, 25, 27, 28, 30)
"""Of the first 32 seeds those that reach what no other of them reaches, or cost next to nothing."""
VOID = 17
"""A scene in which every drop is void, and each command seeks the causes anew: with few drops."""
MANY = 240


@pytest.fixture(autouse=True)
def _trials_once(monkeypatch):
    """Make a layout's trial drops once: `check` and `design` each say what became of them."""
    made = {}

    def once(protocol):
        key = repr(protocol)
        if key not in made:
            made[key] = trials(protocol)
        return made[key]

    monkeypatch.setattr("rig.design.trials.trials", once)
    monkeypatch.setattr(design, "trials", once)


def _assert_sound(drawn: Scene, folder: Path) -> None:
    found = faults(drawn, folder)
    assert not found, "\n".join([drawn.port, drawn.text, *found])


@pytest.mark.parametrize("seed", SOME)
def test_a_scene_goes_through_every_command(seed, tmp_path):
    _assert_sound(scene(seed), tmp_path)


def test_so_does_one_in_which_every_drop_is_void(tmp_path):
    _assert_sound(scene(VOID, drops=2), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [seed for seed in range(MANY) if seed not in SOME])
def test_many_more_scenes_go_through_every_command(seed, tmp_path):
    _assert_sound(scene(seed, drops=12), tmp_path)
