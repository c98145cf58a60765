"""From a protocol and what is to be varied to the grid and all that stays as it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.sweep.grid import Axis, Grid
from rig.sweep.variables import scene_values
from rig.sweep.vary import read_vary

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rig.model.chain import Chain
    from rig.model.surface import Pile
    from rig.protocol.scene import Protocol

MOST_POINTS = 20_000_000
"""Their results take 17 bytes each, all in memory until the file is written."""


@dataclass(frozen=True, slots=True)
class Layout:
    """One sweep, ready to be computed.

    Attributes
    ----------
    grid
    layered
        Whether the first axis are the plan's inclines, there being several and none asked for.
    fixed
        The parameters without an axis, in SI, angles in degrees.
    chain
        The one that strikes.
    longer_m
        How much longer the free chain is; it adds to every separation.
    pile
        The surface's rule for rods that gather, if it has one and it matters.
    """

    grid: Grid
    layered: bool
    fixed: Mapping[str, float]
    chain: Chain
    longer_m: float
    pile: Pile | None


def lay_out(protocol: Protocol, vary: Iterable[str]) -> Layout:
    """Lay out a sweep.

    Parameters
    ----------
    protocol
        The scene; of unlike chains the first one strikes, as in ``rig predict``.
    vary
        As in `rig.sweep.vary.read_vary`.

    Raises
    ------
    InputError
        If the scene has no surface, `vary` has faults, or there are more than `MOST_POINTS`.
    """
    scene = scene_values(protocol)
    varied = read_vary(vary, tuple(scene))
    kept = {name: values for name, values in scene.items() if name not in varied}
    values = kept | varied
    grid = Grid(tuple(Axis(name, each) for name, each in values.items() if len(each) > 1))
    if grid.size > MOST_POINTS:
        shape = " × ".join(map(str, grid.shape))
        raise InputError(
            f"{shape} are {grid.size} points; at most {MOST_POINTS} are accepted",
            "vary less, or hold the incline with --vary incline=40deg",
        )
    first, *others = (one.chain for one in protocol.chains.values())
    return Layout(
        grid=grid,
        layered=any(len(each) > 1 for each in kept.values()),
        fixed={name: each[0] for name, each in values.items() if len(each) == 1},
        chain=first,
        longer_m=others[0].length - first.length if others else 0.0,
        pile=protocol.surface.pile if protocol.surface and "incline" in scene else None,
    )
