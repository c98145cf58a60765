"""Contact heights of rods: height of a rod's middle as it touches a board, for any incline.

A cylinder of radius r and length L, tilted by τ along the level lines of a board inclined by θ,
touches it with one end when its middle is L sin τ/2 + r √(cos²τ + tan²θ) above the board, measured
straight down.
"""

import math
from dataclasses import replace
from operator import lt, sub

from rig.model.chain import Chain
from rig.protocol.protocol import Protocol, RodChain, Run
from rig.units import Quantity


def touching_heights(chain: RodChain, incline_deg: float) -> tuple[float, ...]:
    """Return the height of each rod's middle above a board as it touches, m; bottom up.

    Parameters
    ----------
    chain
        A chain with complete geometry, see `lacking_geometry`; without a rod length all heights are
        too low by the same.
    incline_deg
        Inclination of the board, below 90°.
    """
    tilt = math.radians(chain.tilt_deg)
    end = 0.5 * chain.rod_length * math.sin(tilt)
    across = math.hypot(math.cos(tilt), math.tan(math.radians(incline_deg)))
    return tuple(end + 0.5 * diameter * across for diameter in chain.diameters)


def lacking_geometry(chain: RodChain) -> tuple[str, ...]:
    """Return the missing keys of a chain that `touching_heights` needs."""
    needed = {"diameter", "rod_length"} if chain.tilt_deg else {"diameter"}
    return tuple(filter(needed.__contains__, chain.missing_keys))


def higher_contacts(protocol: Protocol, incline_deg: float, chain: RodChain) -> tuple[float, ...]:
    """Return each rod's contact height less that of the top rod, m; bottom up.

    Zero for a chain without thicknesses, and on a board so steep that rods of unlike thickness
    would strike before the release, or out of turn.
    """
    heights = touching_heights(chain, incline_deg)
    higher = tuple(height - heights[-1] for height in heights)
    strikes = -protocol.drop.value, *map(sub, chain.chain.heights, higher)
    in_turn = higher and all(map(lt, strikes, strikes[1:]))
    return higher if in_turn else (0.0,) * chain.chain.rods


def as_struck(protocol: Protocol, incline_deg: float, struck: str) -> tuple[Chain, Quantity]:
    """Return an equivalent chain and drop height with all contact heights equal.

    A rod that touches higher is moved down along the chain by the same height. Eqs. 8 to 13 have no
    thicknesses: they are left as they are where a chain's geometry is not stated whole.

    Parameters
    ----------
    protocol
        A protocol with heights relative to the contact point, see `at_contact`.
    """
    rods, drop = protocol.chains[struck], protocol.drop
    if lacking_geometry(rods):
        return rods.chain, drop
    strikes = [*map(sub, rods.chain.heights, higher_contacts(protocol, incline_deg, rods))]
    heights = tuple(place - strikes[0] for place in strikes)
    return replace(rods.chain, heights=heights), Quantity(drop.value + strikes[0], drop.u)


def contact_level(protocol: Protocol, incline_deg: float, struck: str) -> Quantity:
    """Return the contact height of the top rod's middle above the zero of the heights, m.

    Parameters
    ----------
    struck
        Name of the striking chain.
    """
    level = protocol.contact.level
    if not protocol.contact.from_board or protocol.stated is not None:
        return level
    *_, top_rod = touching_heights(protocol.chains[struck], incline_deg)
    return Quantity(top_rod + level.value, level.u)


def of_run(protocol: Protocol, run: Run) -> Protocol:
    """Return the scene of a run with all heights relative to its contact point."""
    return at_contact(protocol.of(run), run.incline_deg, run.impact)


def at_contact(protocol: Protocol, incline_deg: float, struck: str | None) -> Protocol:
    """Return a protocol with all heights relative to a run's contact point.

    Parameters
    ----------
    struck
        Name of the striking chain; `None` without a surface.

    Returns
    -------
    Protocol
        With the same uncertainties, and the original as `stated`; the same object if its heights
        are relative to the contact point already.
    """
    if struck is None or protocol.stated is not None:
        return protocol
    level = contact_level(protocol, incline_deg, struck)
    if not protocol.contact.from_board and not level.value:
        return protocol
    lower = (
        replace(gate, height=gate.height - level.value, stated=gate.height)
        for gate in protocol.gates.gates
    )
    drop = Quantity(protocol.drop.value - level.value, protocol.drop.u)
    contact = replace(protocol.contact, level=Quantity(0.0, level.u))
    return replace(protocol.with_gates(lower), drop=drop, contact=contact, stated=protocol)
