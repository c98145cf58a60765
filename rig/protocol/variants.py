"""Keys of the scene that a plan varies.

``plan: {vary: {drop: [100 mm, 200 mm]}}`` stands for two files with another ``drop`` each, so that
every value is checked by the rules of its key, at its own place.
"""

import math
from collections.abc import Iterator
from itertools import product

from rig.printable import one_line
from rig.protocol.fields import Faults
from rig.protocol.yamltree import Mapping, Node, ScalarNode, Sequence

SCENE = ("chains", "surface", "drop", "track", "drag", "contact")
"""First words of keys that runs may vary."""
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
    choices, varied = [], _find(root, ["plan", "vary"])
    for key, values in varied.entries if isinstance(varied, Mapping) else ():
        *way, name = _text(key).split(".")
        section = _find(root, way)
        items = values.items if isinstance(values, Sequence) else []
        if (*way, name)[0] not in SCENE or not isinstance(section, Mapping):
            wanted = f"a key of {', '.join(SCENE)}, in a section that the file has"
        elif section.get(name) is not None:
            wanted = f"{name} in one place; it is also stated by itself"
        elif not 0 < len(items) == len({*map(_text, items)} - {""}):
            wanted = "a list of unlike values"
        else:
            entry = ScalarNode(name, plain=True, place=key.place)
            choices.append([(section.entries, entry, key, item) for item in items])
            continue
        faults.add(key.place, "plan.vary", f"found {key}: {values}; accepted: {wanted}")
    if math.prod(map(len, choices)) > MOST:
        faults.add(key.place, "plan.vary", f"more than {MOST} settings; give fewer values")
    if faults.problems:
        return
    for number, setting in enumerate(product(*choices)):
        for entries, entry, _, value in setting:
            entries[:] = [*(pair for pair in entries if pair[0] is not entry), (entry, value)]
        words = ", ".join(f"{_text(key)} {_text(value)}" for _, _, key, value in setting)
        # What is wrong in the first setting is so in all.
        faults.setting = f" ({words})" if number else ""
        yield one_line(words, len(words))


def _text(node: Node) -> str:
    return node.text if isinstance(node, ScalarNode) else ""


def _find(node: Node | None, way: list[str]) -> Node | None:
    """Return the value at a path of keys; `None` if there is none."""
    for name in way:
        node = node.get(name) if isinstance(node, Mapping) else None
    return node
