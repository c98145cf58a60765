"""What a protocol states of the physics reaches both simulated worlds, or is refused there."""

import copy
from dataclasses import asdict
from functools import cache

import pytest
import yaml

from rig.errors import InputError
from rig.link.messages import pack_label
from rig.protocol.keys import KEYS
from rig.protocol.reader import parse
from sim.dials import Dials, ResolvedDials
from sim.scene import hang_chains
from tests.protocol.keys import around, put, value

pytestmark = pytest.mark.usefixtures("loops_compiled")

BESIDE_THE_FALL = (
    "protocol", "title", "notes", "blind", "reference", "release", "plan", "accept", "priors",
)  # fmt: skip
PHYSICAL = [
    key
    for key in KEYS.values()
    if key.example
    and (key.path == "plan.incline" or key.path.partition(".")[0] not in BESIDE_THE_FALL)
    and not key.path.endswith(("_uncertainty", ".like"))
]


def changed(data: dict, key) -> dict:
    """The same protocol with what the reference has as the key's example."""
    data = copy.deepcopy(data)
    if key.path.endswith("table.[].height"):  # the first one must be 0
        data["chains"]["A"]["masses"]["table"][1]["height"] = "200 mm"
    else:
        put(data, key.path, value(key.example))
    return data


@cache
def drop(text: str, world: str) -> tuple | str:
    """Edges and truth of the first run, on a perfect rig, or why there is none."""
    truths = []
    dials = {"model": Dials, "resolved": ResolvedDials}[world].quiet()
    try:
        edges = hang_chains(parse(text), dials, 1, truths.append).drop(pack_label(1, 1))
    except InputError as error:
        return str(error)
    return edges, *map(asdict, truths)


@pytest.mark.parametrize("world", ["model", "resolved"])
@pytest.mark.parametrize("key", PHYSICAL, ids=lambda key: key.path)
def test_a_physical_key_changes_the_drop_or_is_refused(key, world):
    data = around(key.path, __file__)
    before = drop(yaml.safe_dump(data), world)
    text = yaml.safe_dump(changed(data, key))
    parse(text)  # it is the world that refuses it, if anything does
    after = drop(text, world)
    if isinstance(after, str):
        assert key.path.rpartition(".")[2] in after
    # How rods land on rods is stated for the model; in the resolved world they do.
    ignored = world == "resolved" and key.path.startswith(("surface.pile", "contact.strike"))
    assert (after == before) == ignored
