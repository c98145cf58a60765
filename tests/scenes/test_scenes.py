"""Any scene, any command: it ends, says what is true, and leaves out what is not there."""

import math
import re
from collections.abc import Collection

import pytest

import rig
from bench.studies.falls import Asked, falls, simulation
from bench.studies.time_scales import time_scale
from rig.analysis.session import analyze
from rig.protocol.keys import SECTIONS
from rig.protocol.reader import parse
from sim.dials import Dials
from tests.analysis.drops import case
from tests.analysis.sessions import analysis
from tests.scenes.draw import Scene, scene
from tests.scenes.through import Journey
from tests.tables import read_table

pytestmark = pytest.mark.usefixtures("analysed_once")
SOME = (0, 2, 13, 20, 39, 46, 57, 62, 67, 93, 107, 128, 204, 218, 223)
"""The quickest scenes in which, together, each thing occurs that `draw` has a choice of."""
MANY = 240


@pytest.mark.parametrize("seed", SOME)
def test_a_scene_goes_through_every_command(seed, call, tmp_path):
    Journey(call, scene(seed), tmp_path).go()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [seed for seed in range(MANY) if seed not in SOME])
def test_many_more_scenes_go_through_every_command(seed, call, tmp_path):
    Journey(call, scene(seed, drops=12), tmp_path).go()


@pytest.mark.parametrize("seed", [1051, 1196])
def test_a_scene_of_which_edges_say_little_is_analysed_as_far_as_they_do(seed, tmp_path):
    """No edge but of rods that may have struck; one gate that sees a rod after any strike."""
    odd = scene(seed)
    (path := tmp_path / "scene.yaml").write_text(odd.text, encoding="utf-8")
    runs = [run.number for run in odd.protocol.runs()]
    drops = [*falls([Asked(simulation(path, url=odd.port), [seed], [runs])])]
    results = analyze(odd.protocol, [fall.drop for fall in drops], lambda _: time_scale(seed)).runs
    for result, fall in zip(results, drops, strict=True):
        assert result.verdict == "accepted"
        for name, measured in result.quantities.items():
            error = fall.truth.get(name, measured.value) - measured.value
            assert abs(error) < 2.0 * measured.expanded, name


PRIORS = SECTIONS["priors"]
SLOW = pytest.mark.slow
KINDS = read_table(__file__, "known")
THING = re.compile(r"\[\[(\w+)\|(.*?)\|(.*?)\]\]")


def things(kind: str) -> list[str]:
    """Name what a scene has that may be known exactly."""
    return [*(name for name, *_ in THING.findall(KINDS[kind])), *PRIORS]


def protocol(kind: str, zero: Collection[str]) -> str:
    """A scene that a perfect rig can measure, with some things known exactly."""
    text = THING.sub(lambda thing: thing[3 if thing[1] in zero else 2], KINDS[kind])
    units = {name: key.accepted.unit.replace("1", "") for name, key in PRIORS.items()}
    priors = ", ".join(f"{name}: 0 {units[name]}" for name in PRIORS if name in zero)
    return f"{text}priors: {{{priors}}}\n"


def assert_sound(runs) -> None:
    for run in runs:
        assert run.verdict == "accepted", run.reasons
        assert run.quantities
        for measured in run.quantities.values():
            assert math.isfinite(measured.value)
            assert 0.0 < measured.expanded < 1.0


def known_exactly(kind: str) -> list[tuple[str, ...]]:
    """Give the things that a scene has in groups, neighbours apart: each is zero beside others."""
    return [tuple(things(kind)[first::5]) for first in range(5)]


@pytest.mark.parametrize(
    ("kind", "zeros"),
    [(kind, zeros) for kind in ("two", "fence", "glider") for zeros in known_exactly(kind)],
)
def test_some_things_known_exactly_leave_a_drop_sound(kind, zeros):
    scene = parse(protocol(kind, zeros))
    found = analysis([case(scene, Dials.quiet(), run=run) for run in (1, 2, 3, 4)])
    assert found.joint is not None
    assert_sound(found.runs)


@pytest.mark.parametrize(
    "kind", ["two", *(pytest.param(kind, marks=SLOW) for kind in ("air", "fence", "glider"))]
)
def test_all_known_exactly_goes_through_every_command(kind, call, tmp_path):
    text = protocol(kind, things(kind))
    Journey(call, Scene(1, text, "sim://?quiet=1", parse(text, "zeros.yaml")), tmp_path).go()
    found = rig.open(tmp_path / "scene.session").analyze().runs
    assert_sound(found)
    for measured in found[0].quantities.values():
        assert set(measured.budget) <= {"clock", "edges", "gravity"}
