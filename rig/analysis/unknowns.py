"""Everything that is not known about a drop, with what is known of it beforehand."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SIDE_U = 0.5e-3
"""How much lower one side may hang than the other in every run, m."""
DRAG_U = 0.05
"""What the air may take: κv² of the acceleration, 1/m; a tenth of g at 4.5 m/s."""
ANYTHING = 1.0
"""Prior of release times (s) and α: nothing is known."""
ANY_GRAVITY = 5.0
"""Prior of gravity where it is what a scene measures, m/s²."""


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
