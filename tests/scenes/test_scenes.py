"""Any scene, any command: it ends, says what is true, and leaves out what is not there."""

import math

import pytest

import rig
from rig.protocol.keys import SECTIONS
from rig.protocol.reader import parse
from sim.dials import Dials
from tests.analysis.drops import case
from tests.analysis.sessions import analysis
from tests.scenes.draw import Scene, scene
from tests.scenes.through import Journey

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


PRIORS = SECTIONS["priors"]
SLOW = pytest.mark.slow
GATES = (
    "[{channel: %d, height: 25 mm}, {channel: %d, height: 80 mm}, {channel: %d, height: 130 mm}]"
)
FREE, IMPACT = f"  free: {GATES % (8, 9, 10)}\n", f"  impact: {GATES % (0, 1, 2)}\n"
RODS = "rods: 8, length: 400 mm, mass: 6 g, diameter: 12.7 mm, rod_length: 102 mm, tilt: 12 deg"
SURFACE = """\
surface: {restitution: 0.5{restitution}, friction: 0.2{friction}}
contact: {level: 0 mm{level}, strike: 0 mm{strike}}
plan: {incline: 40 deg, repeats: 4}
"""
KINDS = {
    "two": (f"  A: {{{RODS}{{chain}}}}\n  B: {{like: A}}\n", SURFACE, IMPACT + FREE),
    "air": (f"  A: {{{RODS}{{chain}}}}\n", SURFACE + "drag: {coefficient: 1.1{drag}}\n", IMPACT),
    "fence": ("  A: {rods: 8, length: 400 mm, diameter: 12.7 mm{chain}}\n",
              "plan: {repeats: 4}\n", FREE),
    "glider": ("  A: {rods: 1, diameter: 20 mm{chain}}\n",
               "plan: {repeats: 4}\ntrack: {incline: 12 deg{incline}}\n", FREE),
}  # fmt: skip
STATED = {
    "drop": "2 mm", "gravity": "0.002 m/s^2", "restitution": "0.05", "friction": "0.02",
    "level": "1 mm", "strike": "10 mm", "incline": "0.1 deg", "coefficient": "0.1",
}  # fmt: skip
OF_CHAINS = ("position_uncertainty", "width_uncertainty")
OF_GATES = ("height_uncertainty", "datum_uncertainty")
ALL = (*STATED, *OF_CHAINS, *OF_GATES, "reference", *PRIORS)


def protocol(kind: str, zero: tuple[str, ...]) -> str:
    """A scene that a perfect rig can measure, with some things known exactly."""
    chains, scene, gates = KINDS[kind]
    text = f"protocol: 1\nchains:\n{chains}drop: 300 mm{{drop}}\ngravity: 9.81 m/s^2{{gravity}}\n"
    text += f"{scene}gates:\n{gates}"
    text += "".join(f"  {key}: 0 mm\n" for key in OF_GATES if key in zero)
    text += "reference: 0 ppm\n" if "reference" in zero else ""
    units = {name: key.accepted.unit.replace("1", "") for name, key in PRIORS.items()}
    text += (
        f"priors: {{{', '.join(f'{name}: 0 {units[name]}' for name in PRIORS if name in zero)}}}\n"
    )
    for name, u in STATED.items():
        value, _, unit = u.partition(" ")
        said = f" ± {0 if name in zero else value} {unit}".rstrip()
        text = text.replace(f"{{{'drag' if name == 'coefficient' else name}}}", said)
    return text.replace("{chain}", "".join(f", {key}: 0 mm" for key in OF_CHAINS if key in zero))


def assert_sound(runs) -> None:
    for run in runs:
        assert run.verdict == "accepted", run.reasons
        assert run.quantities
        for measured in run.quantities.values():
            assert math.isfinite(measured.value)
            assert 0.0 < measured.expanded < 1.0


def known_exactly(kind: str) -> list[tuple[str, ...]]:
    """Give the things that a scene has in groups, neighbours apart: each is zero beside others."""
    there = [zero for zero in ALL if protocol(kind, (zero,)) != protocol(kind, ())]
    return [tuple(there[first::5]) for first in range(5)]


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
    text = protocol(kind, ALL)
    Journey(call, Scene(1, text, "sim://?quiet=1", parse(text, "zeros.yaml")), tmp_path).go()
    found = rig.open(tmp_path / "scene.session").analyze().runs
    assert_sound(found)
    for measured in found[0].quantities.values():
        assert set(measured.budget) <= {"clock", "edges", "gravity"}
