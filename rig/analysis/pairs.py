"""What it changes which chain strikes: paired differences over blocks of A, B, B, A.

The mean of runs 1 and 4 less that of runs 2 and 3 is free of any drift that is linear in time, and
of everything that both chains have in common. Half of the release skew's difference goes with the
chains; what stays when they change places goes with the sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import fmean
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.plain_data import attributes
from rig.analysis.result import GOOD, Measured, average
from rig.measurands import MEASURANDS
from rig.protocol.plan import runs as planned_runs

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Protocol

    Array = NDArray[np.float64]

_FIRST = (True, False, False, True)
"""Whether the first chain strikes in each run of a block."""
_CHAINS_OWN = ("spacing", "width")  # lines of a budget that are not the same for both

Block = list["DropResult"]


@dataclass(frozen=True, slots=True)
class Effects:
    """Effects at one incline.

    Attributes
    ----------
    first, second
        The chains: A and B.
    blocks
        Number of complete blocks of good runs.
    chain
        By JSON name: the quantity when the first chain strikes less that when the second does.
    side
        By JSON name: what stays when the chains change places, where without any effect of the
        sides there would be nothing: how much later the free side lets go.
    """

    incline_deg: float
    first: str
    second: str
    blocks: int
    chain: Mapping[str, Measured]
    side: Mapping[str, Measured]

    def json(self) -> dict[str, Any]:
        """One member of ``effects``."""
        said = attributes(self, "incline_deg", "blocks", "chain", "side")
        return said | {"chains": [self.first, self.second]}


def effects(protocol: Protocol, results: Iterable[DropResult]) -> tuple[Effects, ...]:
    """Find the effects of chains and sides at each incline.

    Parameters
    ----------
    results
        The last attempt at each run; blocks that lack a good one do not count.

    Returns
    -------
    tuple of Effects
        In order of incline; none where the plan is no ABBA or one chain does everything.
    """
    if protocol.plan.order != "ABBA" or len(protocol.chains) < 2 or protocol.surface is None:
        return ()
    first, second = list(protocol.chains)[:2]
    good = {result.run.number: result for result in results if result.verdict in GOOD}
    planned: dict[float, list[int]] = {}
    for run in planned_runs(protocol):
        planned.setdefault(run.incline_deg, []).append(run.number)
    found = []
    for incline, numbers in sorted(planned.items()):
        blocks = _blocks([good.get(number) for number in numbers], first)
        if blocks:
            rows = [row for row in MEASURANDS.values() if row.name in blocks[0][0].quantities]
            evenly = np.ones(len(_FIRST)) / len(_FIRST)
            signs = np.where(_FIRST, evenly, -evenly) * 2.0
            chain = {r.name: _contrast(blocks, r.name, signs) for r in rows if r.by_chain}
            side = {r.name: _contrast(blocks, r.name, evenly) for r in rows if r.by_side}
            found.append(Effects(incline, first, second, len(blocks), chain, side))
    return tuple(found)


def _blocks(runs: Sequence[DropResult | None], first: str) -> list[Block]:
    """Cut an incline's runs in fours, and keep those that are whole."""
    fours = (
        runs[end - len(_FIRST) : end] for end in range(len(_FIRST), len(runs) + 1, len(_FIRST))
    )
    whole = ([run for run in four if run is not None] for four in fours)
    # All runs shuffled leave no blocks.
    return [block for block in whole if tuple(one.run.impact == first for one in block) == _FIRST]


def _contrast(blocks: Sequence[Block], name: str, weights: Array) -> Measured:
    """Average a weighted sum over blocks.

    Its uncertainty is the scatter between blocks and within them, or what the runs' own
    uncertainties make of it where that is larger, and what blocks share and the weights do not
    cancel.
    """
    measured = [[run.quantities[name] for run in block] for block in blocks]
    runs = np.array([[one.value for one in block] for block in measured])
    values = runs @ weights
    n, size = len(blocks), float(weights @ weights)
    # Within a block one sum is left that knows of no mean, no chain and no linear drift.
    known = np.stack([np.ones(len(_FIRST)), np.arange(len(_FIRST)), np.where(_FIRST, 1.0, -1.0)])
    rest = np.linalg.svd(known)[2][-1]
    # Its square is of the runs' own scatter only: one more degree of freedom from each block.
    squares = float(np.sum((values - values.mean()) ** 2) + size * np.sum((runs @ rest) ** 2))
    every = [one for block in measured for one in block]
    own = max(0.0, fmean(one.u**2 - _shared(one) ** 2 for one in every)) * size
    freedom = 2 * n - 1.0
    common = _common(measured, weights)
    own, seen = math.sqrt(own / n), math.sqrt(squares / freedom / n)
    return average(float(values.mean()), own, seen, freedom, common, every)


def _common(measured: Sequence[Sequence[Measured]], weights: Array) -> float:
    """What the blocks share, as far as the weights do not cancel it."""
    vectors = [[one.shared for one in block] for block in measured]
    if all(one is not None for block in vectors for one in block):
        mean = np.mean(np.array(vectors, dtype=float), axis=0)
        return float(np.linalg.norm(weights @ mean))
    # Of runs by themselves only the sources are known; of these, two chains share none.
    each = fmean(_shared(one) ** 2 for block in measured for one in block)
    return math.sqrt(each) * math.hypot(weights[0] + weights[3], weights[1] + weights[2])


def _shared(one: Measured) -> float:
    """What of a run's uncertainty other runs share, as far as it does not cancel."""
    if one.shared is not None:
        return float(np.linalg.norm(one.shared))
    return math.hypot(*(one.budget.get(name, 0.0) for name in _CHAINS_OWN))
