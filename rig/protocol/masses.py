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
    points = [(point["height"], point["mass"]) for point in masses["table"]]
    for n, ((low, _), (high, _)) in enumerate(pairwise(points), start=1):
        if low >= high:
            masses["table"][n].reject("height", "heights must increase from point to point")
    lowest, highest = points[0][0], points[-1][0]
    # Rounding may raise a height that is summed from rods above the written value.
    if lowest > 0.0 or highest < heights[-1] * (1.0 - 1e-12):
        message = f"runs from {lowest:g} m to {highest:g} m; the rods are from 0 m"
        masses.reject("table", f"{message} to {heights[-1]:g} m")
    return tuple(_mass_at(points, height) for height in heights)


def _mass_at(points: list[tuple[float, float]], height: float) -> float:
    """Return the interpolated mass at a height within the points."""
    for (low, mass), (high, upper_mass) in pairwise(points):
        if height <= high:
            share = (height - low) / (high - low)
            return mass * (1.0 - share) + upper_mass * share
    return points[-1][1]
