"""Keys that a plan varies: each setting is read like a file of its own."""

import pytest

from rig.errors import InputError
from rig.protocol.plan import runs
from rig.protocol.reader import parse
from rig.units import Quantity
from tests.protocol.test_protocol_reader import GOOD
from tests.refusals import refused

HEIGHTS = "{drop: [180 mm ± 1 mm, 228.5 mm ± 2 mm]}"


def vary(words: str):
    text = GOOD.replace("drop: 180 mm ± 2 mm", "") if "drop" in words else GOOD
    return parse(text.replace("repeats: 4", f"vary: {words}, repeats: 4"), "f")


def test_every_setting_is_a_scene_of_its_own_with_its_own_runs():
    protocol = vary(HEIGHTS)
    scenes = protocol.settings
    heights = [Quantity(0.18, 1e-3), Quantity(0.2285, 2e-3)]
    assert [scene.drop for scene in scenes.values()] == heights
    planned = runs(protocol)
    assert [run.setting for run in planned[::4]] == [*scenes] * 2
    assert len(planned) == 2 * len(runs(parse(GOOD)))
    assert all(protocol.of(run) == scenes[run.setting] for run in planned)
    assert protocol.with_gates(()).of(planned[-1]).gates.gates == ()


def test_keys_are_varied_together_and_need_not_be_stated_elsewhere():
    scenes = vary("{drop: [100 mm, 200 mm], surface.friction: [0.1, 0.2, 0.3]}").settings
    values = [(scene.drop.value, scene.surface.friction.value) for scene in scenes.values()]
    assert values == [(drop, friction) for drop in (0.1, 0.2) for friction in (0.1, 0.2, 0.3)]


def test_what_only_another_setting_has_wrong_is_told_with_it():
    problems = refused(InputError, "", vary, "{drop: [180 mm, 26 mm]}").problems
    assert [problem.line for problem in problems] == [10, 11]
    for problem in problems:
        assert "rod 1 of A blocks before the release" in problem.message
        assert problem.message.endswith("(drop 26 mm)")


@pytest.mark.parametrize("count", [100, 101])
def test_settings_are_counted_before_they_are_read(count):
    words = f"{{surface.friction: [{', '.join(f'0.{200 + n}' for n in range(count))}]}}"
    if count <= 100:
        assert len(vary(words).settings) == count
    else:
        refused(InputError, "more than 100 settings", vary, words)
