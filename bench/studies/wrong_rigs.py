"""Rigs that are not as their protocol says, each wrong in one thing, by a size.

A rig is the protocol file of what really hangs and is wired there: nothing here knows how a fault
is found.
"""

from __future__ import annotations

import json
import re
from copy import deepcopy
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rig.errors import InputError
from rig.protocol.reader import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from collections.abc import Set as AbstractSet

    Scene = dict[str, Any]

_LONG = 6  # rods of which one may be missing that is at no end
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


@dataclass(frozen=True, slots=True)
class WrongRig:
    """What may be wrong.

    Attributes
    ----------
    name
        In words, as the table has them.
    codes
        Of the reasons that name it.
    sizes
        How wrong, in `unit`; none for what is only right or wrong.
    unit
        Of the sizes.
    change
        Turns a protocol into that of the wrong rig; false where a scene has no such thing.
    settings
        Dials of the simulated rig for a size.
    slow
        By what share the clock is slow, for a size.
    """

    name: str
    codes: AbstractSet[str]
    sizes: tuple[float, ...] = (0.0,)
    unit: str = ""
    change: Callable[[Scene, float], bool] = lambda _scene, _size: True
    settings: Callable[[float], Mapping[str, str]] = field(default=lambda _size: {})
    slow: Callable[[float], float] = lambda _size: 0.0

    def words(self, size: float) -> str:
        """Write a size with its unit; nothing for what is only right or wrong."""
        return f"{size:+g} {self.unit}" if self.unit else ""

    def rigs(self, stated: str) -> Iterator[tuple[float, str]]:
        """Yield each size with the protocol file of the rig that is so wrong."""
        for size in self.sizes:
            scene = json.loads(stated)
            text = json.dumps(scene) if self.change(scene, size) else ""
            if text and _possible(text):
                yield size, text


def _possible(text: str) -> bool:
    """Whether a rig can be like that: no rod hangs or lies in a beam."""
    try:
        parse(text)
    except InputError:
        return False
    return True


def _scaled(text: str, by: float) -> str:
    """Multiply a quantity, and leave its uncertainty."""
    return _NUMBER.sub(lambda found: f"{float(found[0]) * by:.9g}", text, count=1)


def _moved(text: str, by_mm: float) -> str:
    """Move a quantity in mm."""
    return _NUMBER.sub(lambda found: f"{float(found[0]) + by_mm:.9g}", text, count=1)


def _own(scene: Scene) -> None:
    """Describe the second chain by itself, so that the first can be another."""
    chains = scene["chains"]
    if chains.get("B") == {"like": "A"}:
        chains["B"] = deepcopy(chains["A"])


def _gates(scene: Scene) -> list[Scene]:
    gates = scene["gates"]
    return [gate for side in ("impact", "free") for gate in gates.get(side, ())]


def _stretched(scene: Scene, percent: float) -> bool:
    _own(scene)
    chain = scene["chains"]["A"]
    if "length" in chain:
        chain["length"] = _scaled(chain["length"], 1.0 + percent / 100.0)
    return "length" in chain


def _more_rods(scene: Scene, more: float) -> bool:
    _own(scene)
    chain = scene["chains"]["A"]
    if not isinstance(chain["rods"], int) or chain["rods"] + more < 2 or "spacing" in chain:
        return False
    chain["length"] = _scaled(chain["length"], 1.0 + more / (chain["rods"] - 1))
    chain["rods"] += int(more)
    return True


def _rod_missing(scene: Scene, _: float) -> bool:
    """Take a rod out of the middle; the others stay where they are."""
    _own(scene)
    chain = scene["chains"]["A"]
    if not isinstance(chain["rods"], int) or "length" not in chain or chain["rods"] < _LONG:
        return False
    gaps = chain["rods"] - 1
    pitch = float(_NUMBER.findall(chain.pop("length"))[0]) / gaps
    chain["rods"] -= 1
    chain["spacing"] = [f"{pitch * (1 + (n == gaps // 2)):.9g} mm" for n in range(gaps - 1)]
    return True


def _thicker(scene: Scene, percent: float) -> bool:
    """Of rods all alike: of several kinds each would be thicker by as much of itself."""
    even = [chain for chain in scene["chains"].values() if "diameter" in chain]
    for chain in even:
        chain["diameter"] = _scaled(chain["diameter"], 1.0 + percent / 100.0)
    return bool(even)


def _hung(scene: Scene, mm: float) -> bool:
    scene["drop"] = _moved(scene["drop"], mm)
    return True


def _raised(gates: list[Scene], mm: float) -> bool:
    for gate in gates:
        gate["height"] = _moved(gate["height"], mm)
    return bool(gates)


def _post(scene: Scene, mm: float) -> bool:
    """Of one gate alone it is the gate's height."""
    gates = scene["gates"]
    return "impact" in gates and len(gates.get("free", ())) > 1 and _raised(gates["free"], mm)


def _one_gate(scene: Scene, mm: float) -> bool:
    gates = _gates(scene)
    return len(gates) > 1 and _raised(gates[-1:], mm)


def _contact(scene: Scene, mm: float) -> bool:
    """Where nothing is struck, only the drop from gate to gate is known."""
    return "surface" in scene and _raised(_gates(scene), mm)


def _attracted(scene: Scene, percent: float) -> bool:
    """Where nothing is struck, gravity is what is measured."""
    scene["gravity"] = _scaled(scene["gravity"], 1.0 + percent / 100.0)
    return "surface" in scene


def _dead(scene: Scene, _: float) -> bool:
    side = scene["gates"].get("impact") or scene["gates"]["free"]
    side.pop()
    return bool(side)


def _exchanged(scene: Scene, sides: float) -> bool:
    """Exchange the lowest and the highest gate of a side, or the lowest ones of both sides."""
    gates = [scene["gates"][side] for side in ("free", "impact") if scene["gates"].get(side)]
    if len(gates) < sides or (len(gates[0]) < 2 and sides < 2):
        return False
    one, other = gates[0][0], gates[1][0] if sides > 1 else gates[0][-1]
    one["channel"], other["channel"] = other["channel"], one["channel"]
    return True


def _crossed(scene: Scene, _: float) -> bool:
    """Hang each chain on the other's side."""
    chains = scene["chains"]
    if chains.get("B", {"like": "A"}) == {"like": "A"}:
        return False
    chains["A"], chains["B"] = chains["B"], chains["A"]
    return True


def _turned(scene: Scene, _: float) -> bool:
    _own(scene)
    chain = scene["chains"]["A"]
    ordered = [name for name in ("rods", "spacing") if isinstance(chain.get(name), list)]
    for name in ordered:
        chain[name] = chain[name][::-1]
    return bool(ordered)


def _tilted(scene: Scene, forgotten: float) -> bool:
    """Leave the board as it was so many inclines before."""
    inclines = scene["plan"].get("incline", ())
    if len(inclines) > 1:
        n = int(forgotten)
        scene["plan"]["incline"] = [*inclines[-n:], *inclines[:-n]]
    return len(inclines) > 1


WRONG_RIGS = (
    WrongRig("chain stretched", {"chain_length"}, (0.3, -1.0, 3.0), "%", _stretched),
    WrongRig("other number of rods", {"rod_count"}, (-1.0, 1.0, 2.0), "rods", _more_rods),
    WrongRig("rod missing", {"rod_missing"}, change=_rod_missing),
    WrongRig("rods thicker", {"thickness"}, (25.0, -20.0), "%", _thicker),
    WrongRig("drop height", {"drop_height"}, (8.0, -15.0, 30.0), "mm", _hung),
    WrongRig("contact level", {"all_gates"}, (3.0, -6.0, 15.0), "mm", _contact),
    WrongRig("clock", {"clock"}, (0.1, -0.5, 2.0), "%", slow=lambda percent: percent / 100.0),
    WrongRig("gravity", {"gravity"}, (0.5, -2.0, 5.0), "%", _attracted),
    WrongRig("air", {"air"}, (0.01, 0.03, 0.08), "per m", settings=lambda k: {"drag": f"{k}"}),
    WrongRig("post's datum", {"post"}, (2.0, 5.0, 15.0), "mm", _post),
    WrongRig("gate off", {"gate_height"}, (3.0, -8.0, 20.0), "mm", _one_gate),
    WrongRig("gate dead", {"gate_silent", "side_silent"}, change=_dead),
    WrongRig("gates exchanged", {"gates_exchanged"}, (1.0, 2.0), "sides", _exchanged),
    WrongRig("chains exchanged", {"chains_exchanged"}, change=_crossed),
    WrongRig("chain upside down", {"upside_down"}, change=_turned),
    WrongRig("wrong incline", {"other_incline"}, (1.0, 2.0), "inclines", _tilted),
)
