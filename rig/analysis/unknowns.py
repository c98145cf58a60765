"""Everything that is not known about a drop, with what is known of it beforehand.

Some of it is the rig's and the chains' own, the same in every drop (`SharedUnknowns`).
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.components import above
from rig.analysis.discrepancy import STRETCHES
from rig.analysis.trajectory import COMMON, DRAG, GRAVITY, RELEASE, START

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

ANYTHING = 1.0
"""Prior of release times (s) and α: nothing is known."""
ANY_GRAVITY = 5.0
"""Prior of gravity where it is what a scene measures, m/s²."""

_RIG = ("clock", "gravity", "drop", "side", "drag", "datum", "beams", "ripple")
_CHAIN = ("rods", "width")


class Unknowns:
    """Named blocks of one long vector of unknowns, each with its prior standard uncertainty.

    All values are deviations from the nominal scene, so the prior mean is zero everywhere.
    """

    def __init__(self) -> None:
        self._blocks: dict[str, slice] = {}
        self._groups: dict[str, list[slice]] = {}
        self._sd: list[float] = []

    def add(self, name: str, group: str, sd: float | Sequence[float] | Array) -> None:
        """Add a block.

        Parameters
        ----------
        name
            To find it.
        group
            The line of the uncertainty budget it belongs to.
        sd
            Prior standard uncertainties.
        """
        values = [sd] if isinstance(sd, int | float) else [*sd]
        block = slice(len(self._sd), len(self._sd) + len(values))
        self._blocks[name] = block
        self._groups.setdefault(group, []).append(block)
        self._sd += values

    def __len__(self) -> int:
        return len(self._sd)

    def __getitem__(self, name: str) -> slice:
        return self._blocks[name]

    def __contains__(self, name: object) -> bool:
        """Whether anything of a block is unknown: what is known exactly is as if it were not."""
        block = self._blocks.get(str(name))
        return block is not None and any(self._sd[block])

    @property
    def blocks(self) -> dict[str, slice]:
        """Place of each block in the vector, by name."""
        return self._blocks

    @property
    def places(self) -> tuple[tuple[str, int, int], ...]:
        """Name, beginning and end of each block."""
        return tuple((name, block.start, block.stop) for name, block in self._blocks.items())

    @cached_property
    def sd(self) -> Array:
        """Prior standard uncertainties once all are added, shape ``(unknowns,)``."""
        return np.array(self._sd)

    @property
    def groups(self) -> dict[str, list[slice]]:
        """Blocks of each line of the uncertainty budget."""
        return self._groups


class SideColumns(NamedTuple):
    """The unknowns that one side knows of, by their places in its own equations.

    Attributes
    ----------
    columns
        Places in the drop's vector, shape ``(columns,)``; first those that move its trajectory.
    at
        Where each is among them, by the place in the drop's vector.
    moving
        How many move its trajectory.
    path
        Derivatives of the trajectory's parameters by these, shape ``(parameters, moving)``.
    """

    columns: Index
    at: Index
    moving: int
    path: Array


@lru_cache(maxsize=64)  # a session asks for the same few again and again
def side_columns(
    places: tuple[tuple[str, int, int], ...],
    role: str,
    gates: tuple[int, ...],
    posts: tuple[str, ...],
    rods: int,
    drawn: tuple[float, ...],
) -> SideColumns:
    """Leave out what the other side alone depends on.

    Parameters
    ----------
    places
        As in `Unknowns`.
    gates
        Numbers of those beside this side's chain.
    posts
        Sides that have a post, in order.
    rods
        Of the chain that strikes; 0 for the free side.
    drawn
        See `rig.analysis.swing.drawn`, of each of these rods as it strikes; none where it does not
        swing.
    """
    at = {name: slice(begin, end) for name, begin, end in places}
    others = ["impact " if role == "free" else "free "]
    if role == "free":
        others += ["alpha", "impulses", "contact", "strike", "top", "landed", "late"]
        others += ["strings", *STRETCHES]
    mine = np.ones(places[-1][2], dtype=np.bool_)
    for name, block in at.items():
        mine[block] = not name.startswith(tuple(others)) and (name, role) != ("side", "impact")
    for name in ("beams", "ripple"):
        if name in at:
            mine[at[name]] &= np.isin(np.arange(at[name].stop - at[name].start), gates)
    mine[at["datum"]] &= np.array(posts) == role
    path = _path(at, role, mine.size, rods, drawn)
    moves = mine & path.any(axis=0)
    moving = np.flatnonzero(moves)
    columns = np.concatenate([moving, np.flatnonzero(mine & ~moves)])
    place = np.zeros(mine.size, dtype=np.intp)
    place[columns] = np.arange(columns.size)
    return SideColumns(columns, place, moving.size, path[:, moving])


def _path(
    at: Mapping[str, slice], role: str, size: int, rods: int, drawn: tuple[float, ...]
) -> Array:
    """Derivatives of a trajectory's parameters by all unknowns."""
    found = np.zeros((COMMON + 2 * rods, size))
    found[RELEASE, at[f"{role} release"]] = found[GRAVITY, at["gravity"]] = 1.0
    found[DRAG, at["drag"]] = 1.0
    found[START, at["drop"]] = found[START, at[f"{role} hang"]] = 1.0
    if role == "free" and "side" in at:
        found[START, at["side"]] = 1.0
    if role == "impact":
        gains, places = slice(COMMON, COMMON + rods), slice(COMMON + rods, COMMON + 2 * rods)
        row = np.arange(rods)
        found[gains, at["alpha"]] = 1.0
        found[COMMON + row, at["impulses"].start + row] = 1.0
        found[gains, at["strings"].start] = above(rods) ** -2.0
        found[COMMON + rods + row, at["impact rods"].start + row] = 1.0
        found[COMMON + rods + row[:-1], at["contact"].start] = -1.0
        found[-1, at["top"]] = 1.0
        if drawn:
            found[places, at["impact swing"].start] = -np.array(drawn)
    return found


class SharedUnknowns:
    """One vector of everything that the drops of a session have in common.

    A chain's rods are the same whether it strikes or falls freely, which is what tells them from
    beam heights: chains change sides, beams do not. Gravity is common too, unless it is what is
    measured: then each drop has its own.

    Attributes
    ----------
    blocks
        Place of each block in the vector, by name.
    """

    def __init__(self, models: Iterable[DropModel]) -> None:
        self.blocks: dict[str, slice] = {}
        self._size = 0
        for model in models:
            for name, block in _names(model).items():
                if name not in self.blocks:
                    size = block.stop - block.start
                    self.blocks[name] = slice(self._size, self._size + size)
                    self._size += size

    def __len__(self) -> int:
        return self._size

    def places(self, model: DropModel) -> tuple[Index, Index]:
        """Where a drop's common unknowns are, in its own vector and in this one."""
        names = _names(model)
        own = [np.arange(block.start, block.stop) for block in names.values()]
        here = [np.arange(self.blocks[n].start, self.blocks[n].stop) for n in names]
        return np.concatenate(own), np.concatenate(here)


def _names(model: DropModel) -> dict[str, slice]:
    """Blocks of one drop that are common, by the name they have for all."""
    at = model.unknowns
    # Where gravity is the result, each drop measures it for itself, and runs are averaged.
    measured = {"gravity"} if model.protocol.surface is None else set()
    found = {name: at[name] for name in _RIG if name in at and name not in measured}
    for role, record in model.records.items():
        if role == "impact":
            for name in ("contact", "usual stretch", "strings"):
                found[f"{name} at {record.condition}"] = at[name]
        found |= {f"{record.chain.name} {what}": at[f"{role} {what}"] for what in _CHAIN}
    return found
