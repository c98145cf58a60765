"""The ``masses`` of a chain: rod by rod, or along a profile."""

from __future__ import annotations

from itertools import pairwise

from rig.protocol.fields import Section, UnsoundError
from rig.protocol.rods import RodValues


def place_masses(chain: Section, heights: RodValues) -> RodValues:
    """Return the mass of each rod, kg, bottom up.

    Masses are listed rod by rod; or follow ``{exponential: {bottom: …, top: …}}``, with a constant
    ratio from each rod to the next; or ``{table: [{height: …, mass: …}, …]}``, with linear
    interpolation.

    Parameters
    ----------
    chain
        The chain with its ``masses``.
    heights
        Heights of the rods' middles above that of the bottom rod, m.
    """
    masses, rods = chain["masses"], len(heights)
    if isinstance(masses, tuple):
        if len(masses) != rods:
            message = f"found {len(masses)} masses for {rods} rods; state one for each rod"
            chain.reject("masses", message)
        return masses
    profile = masses and masses.need("exponential", "table")
    if not profile or not masses.is_sound():
        raise UnsoundError
    if profile == "table":
        return _interpolate(masses, heights)
    if rods == 1:
        masses.reject("exponential", "one object has one mass; state it as mass", at_key=True)
    bottom, top = masses["exponential"]["bottom"], masses["exponential"]["top"]
    between = ((top / bottom) ** (rod / (rods - 1)) for rod in range(1, rods - 1))
    return (bottom, *(bottom * share for share in between), top)


def _interpolate(masses: Section, heights: RodValues) -> RodValues:
    """Return masses by linear interpolation in a table."""
    import numpy as np  # noqa: PLC0415 - most chains have no table

    table = masses["table"]
    places = [point["height"] for point in table]
    for n, (low, high) in enumerate(pairwise(places), start=1):
        if low >= high:
            table[n].reject("height", "heights must increase from point to point")
    # Rounding may raise a height that is summed from rods above the written value.
    if places[0] > 0.0 or places[-1] < heights[-1] * (1.0 - 1e-12):
        message = f"runs from {places[0]:g} m to {places[-1]:g} m; the rods are from 0 m"
        masses.reject("table", f"{message} to {heights[-1]:g} m")
    return tuple(np.interp(heights, places, [point["mass"] for point in table]).tolist())
