"""What Eqs. 8 to 13 leave out, smoothly: how strings stretch a chain.

The equations take strings as dead. Real ones throw rods back: 60 ms after the first strike the top
rod of resolved falls is up to 4 mm ahead of its place, the middle of the chain still in it, alike
from rod to rod. Taken for independent departures of so many edges it would average away, and draw
the release along. So each drop has a few smooth modes of its own: powers of a rod's place along the
chain, which are small but at the top, and the chain as a whole, times a way that grows and one that
soon stays as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.trajectory import struck_trajectory

if TYPE_CHECKING:
    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.equations import Expected
    from rig.analysis.trajectory import Trajectory
    from rig.arrays import Array, Index
    from rig.protocol.protocol import Protocol


LOWEST_START = 1e-3
"""Where a struck chain hangs at least, m: an adjustment of nonsense tries what is below ground."""

_POWERS = {0.0: 0.5, 2.0: 1.0, 6.0: 1.0}
"""Of a rod's place, 0 at the bottom and 1 at the top, and the amplitude of each: 0 for a chain that
is late as a whole, for strings pass a pull on by and by. A quarter to all of it covers as well, and
a single 3 beside it."""
_GROWTH = 3.0
"""Of the lasting mode until the last strike, in amplitudes of the one that soon stays."""
_SOON = 6.0
"""Time constants of the latter from the first strike to the last: 50 of 320 ms."""
MODES = 2 * len(_POWERS)
STRETCHES = ("stretch", "usual stretch")
"""Blocks of unknowns: of a drop alone, and of all drops of a condition."""


class StretchModes(NamedTuple):
    """How much further rods have fallen than their chain, by each mode, at some moments.

    Attributes
    ----------
    way, rate
        In amplitudes, and its derivative by time, 1/s; shape ``(moments, MODES)``.
    """

    way: Array
    rate: Array


@dataclass(frozen=True)
class Discrepancy:
    """How a chain that strikes leaves the equations, by its nominal fall.

    When the chain is at a level is taken from that fall: which functions the modes are is a choice,
    and with this one the observation equations are linear in them.

    Attributes
    ----------
    nominal
        The fall, as the protocol has it.
    stretch
        `StretchModes.way` at each expected edge, shape ``(edges, MODES)``.
    late_pull, late_way
        How much faster all of the last impulse makes the top rod, m/s, and what way is left below
        the lowest beam, m: what of it comes there, no edge tells.
    """

    nominal: Trajectory
    stretch: Array
    late_pull: float
    late_way: float

    @classmethod
    def of(
        cls, record: ChainRecord, edges: Expected, protocol: Protocol, kappa: float
    ) -> Discrepancy:
        """Take the chain's nominal fall in air of some κ, 1/m."""
        assert record.ratios is not None
        assert protocol.gates is not None
        strikes, gains = record.strikes, np.full(record.strikes.size, record.alpha)
        start, gravity = max(protocol.drop.value, LOWEST_START), protocol.gravity.value
        nominal = struck_trajectory(
            0.0, start, gravity, gains, record.ratios, strikes, kappa, record.air
        )
        stretch = stretch_modes(nominal, edges.rods, edges.levels).way
        if nominal.hits is None or strikes.size < 2:
            return cls(nominal, stretch, 0.0, 0.0)
        pull = abs(record.alpha) * float(nominal.hits.ratio[-2] * nominal.hits.arrival[-2])
        seeing = [train for train in record.trains if strikes.size - 1 in train.rods]
        lowest = min((protocol.gates.gates[beam.gate].height for beam in seeing), default=np.inf)
        hidden = max(0.0, min(lowest, float(strikes[-1] - strikes[-2])))
        return cls(nominal, stretch, pull, hidden)

    def top(self, levels: Array) -> StretchModes:
        """Return the modes at the top rod, the reference point being at some levels, m."""
        last = self.nominal.time.size - 2
        return stretch_modes(self.nominal, np.full(levels.shape, last), levels)


def stretch_modes(nominal: Trajectory, rods: Index, levels: Array) -> StretchModes:
    """Evaluate the modes of the stretch at some rods; zero where one rod strikes.

    Parameters
    ----------
    nominal
        A fall with impacts: modes begin at its first one, and are scaled to its last.
    rods
        From the bottom up, shape ``(moments,)``.
    levels
        Of the reference point, m, shape ``(moments,)``.
    """
    last = nominal.time.size - 2
    if last < 1:
        nothing = np.zeros((levels.size, MODES))
        return StretchModes(nothing, nothing)
    first, lasting = float(nominal.time[1]), float(nominal.time[-1] - nominal.time[1])
    share = np.maximum(nominal.times(levels) - first, 0.0) / lasting
    begun = np.where(share > 0.0, 1.0, 0.0)
    fading: Array = begun * np.exp(-_SOON * share)
    along = np.stack([size * (rods / last) ** power for power, size in _POWERS.items()], axis=1)

    def product(growing: Array, staying: Array) -> Array:
        in_time = np.stack([growing, staying], axis=1)
        return (along[:, :, None] * in_time[:, None, :]).reshape(levels.size, MODES)

    return StretchModes(
        product(_GROWTH * share, begun - fading),
        product(begun * _GROWTH / lasting, fading * _SOON / lasting),
    )
