"""Keys of the scene that a plan varies.

``plan: {vary: {drop: [100 mm, 200 mm]}}`` stands for two files with another ``drop`` each, so that
every value is checked by the rules of its key, at its own place.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

from rig.protocol.fields import Faults
from rig.protocol.yamltree import Mapping, Node, ScalarNode, Sequence

SCENE = ("chains", "surface", "drop", "gravity", "track", "drag", "contact")
"""First words of keys that runs may vary, and attributes of a protocol that follow from them."""
MOST = 100
"""Most settings of a plan: each is read like a file of its own."""


def vary(root: Node, faults: Faults) -> Iterator[str]:
    """Set the keys that a file's plan varies to each combination of values, in place.

    Parameters
    ----------
    root
        The file.
    faults
        Collects keys that runs cannot vary.

    Yields
    ------
    str
        The setting in words; once an empty one if the plan varies nothing.
    """
    choices = []
    for key, values in _entries(_find(root, ["plan", "vary"])):
        *way, name = _text(key).split(".")
        section = _find(root, way)
        items = values.items if isinstance(values, Sequence) else []
        unlike = 0 < len(items) == len({*map(str, items)})
        if not unlike or (*way, name)[0] not in SCENE or not isinstance(section, Mapping):
            wanted = "a key of the scene, such as drop, with a list of unlike values"
            faults.add(key.place, "plan.vary", f"found {_text(key)}: {values}; accepted: {wanted}")
        else:
            section.entries[:] = [pair for pair in section.entries if _text(pair[0]) != name]
            entry = ScalarNode(name, plain=True, place=key.place)
            choices.append([(section.entries, entry, _text(key), item) for item in items])
    if math.prod(map(len, choices)) > MOST:
        faults.add(root.place, "plan.vary", f"more than {MOST} settings; give fewer values")
        return
    for number, setting in enumerate(product(*choices)):
        for entries, entry, _, value in setting:
            entries[:] = [*(pair for pair in entries if pair[0] is not entry), (entry, value)]
        words = ", ".join(f"{name} {_text(value) or value}" for _, _, name, value in setting)
        faults.setting = words * (number > 0)  # what is wrong in the first is so in all
        yield words


def _text(node: Node) -> str:
    return node.text if isinstance(node, ScalarNode) else ""


def _entries(node: Node | None) -> list[tuple[Node, Node]]:
    return node.entries if isinstance(node, Mapping) else []


def _find(node: Node | None, way: list[str]) -> Node | None:
    """Return the value at a path of keys; `None` if there is none."""
    for name in way:
        node = node.get(name) if isinstance(node, Mapping) else None
    return node
