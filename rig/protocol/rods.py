"""The rods of a chain: diameters, masses and heights."""

from itertools import accumulate, pairwise

from rig.model.chain import equal_gaps
from rig.protocol.fields import Section, UnsoundError
from rig.protocol.keys import MOST_RODS
from rig.units import Quantity, format_quantity

RodValues = tuple[float, ...]
"""A value for each rod, bottom up."""


def list_groups(section: Section) -> list[tuple[int, Section]]:
    """Return the groups of a chain whose ``rods`` are sound; equal rods have the chain's keys."""
    rods = section["rods"]
    return [(rods, section)] if isinstance(rods, int) else [(each["count"], each) for each in rods]


def count_rods(section: Section) -> int:
    """Return the number of rods of a chain whose ``rods`` are sound."""
    return sum(count for count, _ in list_groups(section))


def list_rods(section: Section, top: Section) -> tuple[RodValues, RodValues, bool]:
    """Return the rods of a chain of a file by its ``rods``, ``diameter`` and ``mass``, bottom up.

    Masses are those given; otherwise proportional to the cross-section (same material) with 1 for
    the bottom rod; otherwise all 1. A single rod is any object, which may fall but not strike.

    Returns
    -------
    tuple
        Diameters, m, 0 if unknown; masses; and whether these are in kg: otherwise only their
        ratios are known.
    """
    section.require_sound("rods", "diameter", "mass")
    total = count_rods(section)
    if total > MOST_RODS:
        section.reject("rods", f"found {total} rods; at most {MOST_RODS} are accepted")
    if total == 1 and "surface" in top:
        message = "found 1 rod; a chain that strikes a surface has at least 2"
        section.reject("rods", f"{message}; for one object leave surface out")
    each = [group for count, group in list_groups(section) for _ in range(count)]
    diameters, masses = (
        [section[key] if rod[key] is None else rod[key] for rod in each]
        for key in ("diameter", "mass")
    )
    weighed = None not in masses
    if not weighed and any(masses):
        section.reject("rods", "mass is given for some groups only; state it for all or none")
    if None in diameters:
        if "gates" in top or any(diameters):
            section.need("diameter")
            section.require_sound("diameter")
        diameters = [0.0] * total
    if not weighed:
        masses = [(d / diameters[0]) ** 2 if diameters[0] else 1.0 for d in diameters]
    return tuple(diameters), tuple(masses), weighed


def place_rods(section: Section, diameters: RodValues) -> RodValues:
    """Return the heights of the rods' middles above the bottom rod's, m.

    Equal gaps: neighbours i, i+1 are ``gap + (d_i + d_{i+1})/2`` apart, with the gap that gives the
    stated length.

    Parameters
    ----------
    section
        The chain, with its ``length`` and ``spacing``.
    diameters
        Of the rods, m, bottom up; shape ``(rods,)``.

    Returns
    -------
    tuple of float
        Shape ``(rods,)``.
    """
    last, length, spacing = len(diameters) - 1, section["length"], section["spacing"]
    if last == 0:
        return (0.0,)
    if isinstance(spacing, tuple):
        if len(spacing) != last:
            message = f"found {len(spacing)} distances; {last} are between {last + 1} rods"
            section.reject("spacing", message)
        return tuple(accumulate(spacing, initial=0.0))
    if spacing == "equal-pitch":
        return tuple(length * rod / last for rod in range(last + 1))
    return equal_gaps(diameters, length)


def check_apart(section: Section, heights: RodValues, widths: RodValues, rise: float) -> None:
    """Check that no two neighbours overlap as seen from the side, nor touch with their ends.

    Parameters
    ----------
    section
        The chain, where a fault is noted.
    heights, widths
        Of the rods, m, bottom up; shape ``(rods,)``.
    rise
        Height of a tilted rod's upper end above its lower end, m; 0 if unknown.
    """
    key = "length" if "length" in section else "spacing"
    neighbours = zip(pairwise(heights), pairwise(widths), strict=True)
    for rod, ((low, high), (lower, upper)) in enumerate(neighbours, start=1):
        pitch, needed = high - low, (lower + upper) / 2
        if not pitch > needed:
            apart, thick = (format_quantity(Quantity(x), "mm") for x in (pitch, needed))
            message = f"rods {rod} and {rod + 1} overlap: {apart} apart but {thick} thick"
            section.reject(key, message)
        if rise >= pitch:
            height = format_quantity(Quantity(rise), "mm")
            message = f"tilted ends rise {height}, so rods {rod} and {rod + 1} would touch"
            section.reject("rod_length", message)


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
