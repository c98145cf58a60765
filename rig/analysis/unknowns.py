"""Everything that is not known about a drop, with what is known of it beforehand.

Some of it is the rig's and the chains' own, the same in every drop (`SharedUnknowns`).
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

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
        return name in self._blocks

    @property
    def blocks(self) -> dict[str, slice]:
        """Place of each block in the vector, by name."""
        return self._blocks

    @cached_property
    def sd(self) -> Array:
        """Prior standard uncertainties once all are added, shape ``(unknowns,)``."""
        return np.array(self._sd)

    @property
    def groups(self) -> dict[str, list[slice]]:
        """Blocks of each line of the uncertainty budget."""
        return self._groups


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
            for name in ("contact", "strings"):
                found[f"{name}, {record.condition}"] = at[name]
        found |= {f"{record.chain.name} {what}": at[f"{role} {what}"] for what in _CHAIN}
    return found
