"""What it changes which chain strikes: paired differences over blocks of A, B, B, A.

The mean of runs 1 and 4 less that of runs 2 and 3 is free of any drift that is linear in time, and
of everything that both chains have in common. Half of the release skew's difference goes with the
chains; what stays when they change places goes with the sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.averages import ABBA, effect
from rig.analysis.plain_data import attributes
from rig.analysis.result import GOOD
from rig.measurands import MEASURANDS
from rig.protocol.plan import runs as planned_runs

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from rig.analysis.result import DropResult, Measured
    from rig.protocol.protocol import Protocol

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
        fields = attributes(self, "incline_deg", "blocks", "chain", "side")
        return fields | {"chains": [self.first, self.second]}


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
    every = []
    for incline, numbers in sorted(planned.items()):
        blocks = _blocks([good.get(number) for number in numbers], first)
        if blocks:
            rows = [row for row in MEASURANDS.values() if row.name in blocks[0][0].quantities]
            evenly = np.ones(len(ABBA)) / len(ABBA)
            signs = np.where(ABBA, evenly, -evenly) * 2.0
            measured = {
                row.name: [[run.quantities[row.name] for run in block] for block in blocks]
                for row in rows
            }
            chain = {r.name: effect(measured[r.name], signs) for r in rows if r.by_chain}
            side = {r.name: effect(measured[r.name], evenly) for r in rows if r.by_side}
            every.append(Effects(incline, first, second, len(blocks), chain, side))
    return tuple(every)


def _blocks(runs: Sequence[DropResult | None], first: str) -> list[Block]:
    """Cut an incline's runs in fours, and keep those that are whole."""
    fours = (runs[end - len(ABBA) : end] for end in range(len(ABBA), len(runs) + 1, len(ABBA)))
    full = ([run for run in four if run is not None] for four in fours)
    # All runs shuffled leave no blocks.
    return [block for block in full if tuple(r.run.impact == first for r in block) == ABBA]
