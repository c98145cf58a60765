"""What Eqs. 8 to 13 leave out, smoothly: how strings stretch a chain, and how impulses differ.

The equations take strings as dead. Real ones throw rods back: 60 ms after the first strike the top
rod of resolved falls is up to 4 mm ahead of its place, the middle of the chain still in it, alike
from rod to rod. Taken for independent departures of so many edges it would average away, and draw
the release along. So each drop has a few smooth modes of its own: powers of a rod's place along the
chain, which are small but at the top, times a way that grows and one that soon stays as it is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.components import above

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.analysis.trajectory import Trajectory

    Array = NDArray[np.float64]

_POWERS = (2.0, 6.0)
"""Of a rod's place, 0 at the bottom and 1 at the top; a single 3 covers as well."""
_GROWTH = 3.0
"""Of the lasting mode until the last strike, in amplitudes of the one that soon stays."""
_SOON = 6.0
"""Time constants of the latter from the first strike to the last: 50 of 320 ms."""
MODES = 2 * len(_POWERS)
STRETCHES = ("stretch", "usual stretch")
"""Blocks of unknowns: of a drop alone, and of all drops of a condition."""
IMPULSE_MODES = 4
"""Of impulses along a chain: those of six rods in a row are alike, of 25."""


class StretchModes(NamedTuple):
    """How much further rods have fallen than their chain, by each mode, at some moments.

    Attributes
    ----------
    way, rate
        In amplitudes, and its derivative by time, 1/s; shape ``(moments, MODES)``.
    """

    way: Array
    rate: Array


def stretch_modes(path: Trajectory, places: Array, times: Array) -> StretchModes:
    """Evaluate the modes at some rods and times.

    Parameters
    ----------
    path
        A fall with impacts: modes begin at its first one, and are scaled to its last.
    places
        Of rods along the chain, 0 at the bottom and 1 at the top, shape ``(moments,)``.
    times
        s, shape ``(moments,)``.
    """
    first, lasting = float(path.time[1]), float(path.time[-1] - path.time[1])
    share = np.maximum(times - first, 0.0) / lasting
    begun = np.where(share > 0.0, 1.0, 0.0)
    fading: Array = begun * np.exp(-_SOON * share)
    along = np.stack([places**power for power in _POWERS], axis=1)

    def product(growing: Array, staying: Array) -> Array:
        in_time = np.stack([growing, staying], axis=1)
        return (along[:, :, None] * in_time[:, None, :]).reshape(places.size, MODES)

    return StretchModes(
        product(_GROWTH * share, begun - fading),
        product(begun * _GROWTH / lasting, fading * _SOON / lasting),
    )


def impulse_modes(rods: int) -> Array:
    """Return how impulses differ along a chain: smoothly, and by the pull of strings at its end.

    Returns
    -------
    ndarray
        Shape ``(rods, IMPULSE_MODES + 1)``: cosines of unit mean square together, and 1/M² for M
        rods above, 1 for the last pull.
    """
    place = (np.arange(rods) + 0.5) / rods
    waves = np.cos(math.pi * place[:, None] * np.arange(1, IMPULSE_MODES + 1))
    return np.column_stack([math.sqrt(2.0 / IMPULSE_MODES) * waves, above(rods) ** -2.0])
