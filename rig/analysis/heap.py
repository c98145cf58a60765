"""Rods that lie where others strike: how high, by geometry, and the protocol of such a fall."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rig.protocol.contact import lacking_geometry, touching_heights
from rig.units import Quantity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.model.surface import Surface
    from rig.protocol.protocol import Protocol, RodChain, Run

    Array = NDArray[np.float64]

UNEVEN = 1 / 3
"""Relative standard uncertainty of the height of a heap: tops of heaps of resolved rods scatter by
27 % about `heap_heights`, from 16 to 36 rods and 0 to 30°."""


def on_heap(protocol: Protocol, run: Run) -> Protocol | None:
    """Return the protocol of a run whose rods may strike what lies there.

    Parameters
    ----------
    protocol
        With heights counted from the contact point, see `rig.protocol.contact.at_contact`.

    Returns
    -------
    Protocol or None
        With ``contact.heaped``, and the top rod's strike on it; `None` where by geometry less
        than one rod lies there as the top rod strikes.
    """
    chain = None if run.impact is None else protocol.chains[run.impact]
    if protocol.surface is None or chain is None or "diameter" in lacking_geometry(chain):
        return None
    top = strike_heights(protocol.surface, run.incline_deg, chain)[-1]
    if top < max(chain.diameters):  # what is lower than one of its rods is no heap
        return None
    strike = protocol.contact.strike
    higher = Quantity(strike.value + top, math.hypot(strike.u, UNEVEN * top))
    return replace(protocol, contact=replace(protocol.contact, heaped=True, strike=higher))


@lru_cache(maxsize=64)  # a session asks for the same few again and again
def strike_heights(
    surface: Surface, incline_deg: float | None, chain: RodChain
) -> tuple[float, ...]:
    """How far above the contact point each rod strikes what lies there, m; bottom up."""
    incline = incline_deg or 0.0
    # How long rods are lifts all alike.
    touching = np.array(touching_heights(replace(chain, rod_length=0.0), incline))
    return tuple((touching - touching[-1] + heap_heights(chain, surface, incline)).tolist())


def heap_heights(chain: RodChain, surface: Surface, incline_deg: float) -> Array:
    """How high others lie as each rod strikes, m; shape ``(rods,)``.

    Friction μ takes μ (1 + β) cos θ of the speed V with which a rod strikes, so that V (sin θ −
    μ (1 + β) cos θ) is left down the board. As the next one comes, a distance p behind, it has
    gone by that share of p. What of its thickness d is still there fills a square of side d in a
    heap as high as half as wide.
    """
    angle, thick = math.radians(incline_deg), np.array(chain.diameters)
    gaps = np.diff(chain.chain.heights, append=np.inf)
    stopped = surface.friction.value * (1.0 + surface.restitution.value) * math.cos(angle)
    gone = gaps[:-1] * max(0.0, math.sin(angle) - stopped)
    lying = thick[:-1] * np.maximum(thick[:-1] - gone, 0.0)
    return np.asarray(np.sqrt(np.cumsum(np.append(0.0, lying))))
