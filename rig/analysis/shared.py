"""Which unknowns of a drop are the rig's and the chains' own, the same in every drop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

_RIG = ("clock", "gravity", "drop", "side", "drag", "beams", "ripple")
_CHAIN = ("rods", "width")


class Shared:
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
    measured = {"gravity"} if model.protocol.surface is None else set()
    found = {name: at[name] for name in _RIG if name in at and name not in measured}
    for role, side in model.sides.items():
        found |= {f"{side.chain.name} {what}": at[f"{role} {what}"] for what in _CHAIN}
    return found
