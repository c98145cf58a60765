"""Effects of chains and sides: paired differences over blocks of A, B, B, A.

The mean of runs 1 and 4 less that of runs 2 and 3 is free of linear drift, and of errors that both
chains share. Half of the release skew's difference is an effect of the chains; the part that
remains when they change places is an effect of the sides.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from rig.analysis.averages import combine
from rig.analysis.result import DropResult, Measured, good_runs
from rig.arrays import Array
from rig.measurands import of_kind
from rig.plain_data import Record
from rig.protocol.protocol import Protocol

_CHAINS_OWN = ("spacing", "width")  # common lines of a budget that differ between chains


@dataclass(frozen=True, slots=True)
class Effects(Record):
    """Effects at an incline.

    Attributes
    ----------
    chains
        Names of the chains, A and B.
    blocks
        Number of complete blocks of good runs.
    chain
        By JSON name: the quantity when the first chain strikes less that when the second strikes.
    side
        By JSON name: the part that remains when the chains change places, zero without an effect
        of the sides: the delay of the free side's release.
    """

    MEMBERS = "incline_deg setting? blocks chain side chains"

    incline_deg: float
    setting: str
    chains: tuple[str, str]
    blocks: int
    chain: Mapping[str, Measured]
    side: Mapping[str, Measured]


def effects(protocol: Protocol, results: Iterable[DropResult]) -> tuple[Effects, ...]:
    """Return the effects of chains and sides at each incline.

    Parameters
    ----------
    results
        The last attempt at each run; only blocks of four good runs count.

    Returns
    -------
    tuple of Effects
        In order of incline; empty if the plan is not ABBA or there is a single chain.
    """
    if protocol.plan.order != "ABBA" or len(protocol.chains) < 2 or protocol.surface is None:
        return ()
    first, second = list(protocol.chains)[:2]
    order = [first, second, second, first]
    good = {result.run: result for result in good_runs(results)}
    signs = np.array([1.0, -1.0, -1.0, 1.0])  # first chain less second, for each run of a block
    planned, every = protocol.runs(), []
    for incline, setting in product(sorted({*protocol.plan.inclines}), protocol.settings):
        runs = [run for run in planned if (run.incline_deg, run.setting) == (incline, setting)]
        fours = zip(*(runs[place::4] for place in range(4)), strict=False)
        blocks = [
            [good[run] for run in four]
            for four in fours
            # A shuffled plan has no ABBA blocks.
            if good.keys() >= {*four} and [run.impact for run in four] == order
        ]
        if blocks:
            known = blocks[0][0].quantities
            chain, side = (
                {r.name: _effect(blocks, r.name, weight) for r in of_kind(kind, known)}
                for kind, weight in (("by_chain", signs / 2.0), ("by_side", signs**2 / 4.0))
            )
            every.append(Effects(incline, setting, (first, second), len(blocks), chain, side))
    return tuple(every)


def _effect(blocks: Sequence[Sequence[DropResult]], name: str, weights: Array) -> Measured:
    """Return the mean over blocks of a weighted sum of runs; all but chains' own errors cancel."""
    runs = [[drop.quantities[name] for drop in block] for block in blocks]
    values = np.array([[run.value for run in block] for block in runs])
    # Scatter of the sums between blocks, and another degree of freedom from each block.
    squares = np.sum((values @ weights - np.mean(values @ weights)) ** 2)
    # The contrast of a block that is free of its mean, its chains and linear drift.
    rest = values @ [1.0, -3.0, 3.0, -1.0]
    squares += weights @ weights * np.sum(rest**2) / 20.0
    freedom = 2.0 * len(blocks) - 1.0
    chains = [[block[n] for block in runs for n in pair] for pair in ((0, 3), (1, 2))]
    scatter = math.sqrt(squares / freedom / len(blocks)), freedom
    return combine(chains, 2.0 * weights[:2], scatter, _CHAINS_OWN)
