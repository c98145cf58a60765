"""The rods of a chain: which there are, and where they hang."""

from __future__ import annotations

import math
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, NamedTuple

from rig.protocol.keys import MOST_RODS
from rig.units import Quantity, format_quantity

if TYPE_CHECKING:
    from rig.protocol.fields import Section


class Rods(NamedTuple):
    """Diameter (m; 0 where unknown) and mass of each rod, bottom up.

    `weighed` says that masses are in kg; else only their ratios mean something.
    """

    diameters: tuple[float, ...]
    masses: tuple[float, ...]
    weighed: bool


def list_rods(section: Section, *, seen_by_gates: bool, struck: bool) -> Rods | None:
    """Return the rods of a chain by its ``rods``, ``diameter`` and ``mass``.

    Masses are those given, else proportional to the cross-section (like material) with the
    bottom rod's as 1, else all 1. One rod alone is any object, which may fall and never strikes.
    """
    if not section.is_sound("rods", "diameter", "mass"):
        return None
    groups = section["rods"]
    if isinstance(groups, int):
        groups = [{"count": groups, "diameter": None, "mass": None}]
    total = sum(group["count"] for group in groups)
    if total > MOST_RODS:
        section.fault("rods", f"found {total} rods; at most {MOST_RODS} are accepted")
        return None
    if total == 1 and struck:
        message = "found 1 rod; a chain that strikes a surface has at least 2"
        section.fault("rods", f"{message}; for one object leave surface out")
        return None
    diameters, masses = (
        [
            section[key] if group[key] is None else group[key]
            for group in groups
            for _ in range(group["count"])
        ]
        for key in ("diameter", "mass")
    )
    weighed = None not in masses
    if not weighed and any(mass is not None for mass in masses):
        section.fault("rods", "mass is given for some groups only; state it for all or none")
        return None
    if None in diameters:
        if seen_by_gates or any(diameter is not None for diameter in diameters):
            section.need("diameter")
            return None
        diameters = [0.0] * total
    if not weighed:
        masses = [(d / diameters[0]) ** 2 if diameters[0] else 1.0 for d in diameters]
    return Rods(tuple(diameters), tuple(masses), weighed)


def place_rods(section: Section, diameters: tuple[float, ...]) -> tuple[float, ...] | None:
    """Return the heights of the rods' middles above the bottom rod's, m.

    Equal gaps: neighbours i, i+1 are ``gap + (d_i + d_{i+1})/2`` apart, the gap being whatever
    makes the whole chain as long as stated.

    Parameters
    ----------
    section
        The chain, with its ``length`` and ``spacing``.
    diameters
        Of the rods, m, bottom up; shape ``(rods,)``.

    Returns
    -------
    tuple of float or None
        Shape ``(rods,)``; `None` if a wrong number of distances is listed, which is noted.
    """
    last, length, spacing = len(diameters) - 1, section["length"], section["spacing"]
    if last == 0:
        return (0.0,)
    if isinstance(spacing, tuple):
        if len(spacing) != last:
            message = f"found {len(spacing)} distances; {last} are between {last + 1} rods"
            section.fault("spacing", message)
            return None
        return tuple(accumulate(spacing, initial=0.0))
    if spacing == "equal-pitch":
        return tuple(length * rod / last for rod in range(last + 1))
    halves = [(lower + upper) / 2 for lower, upper in pairwise(diameters)]
    gap = (length - math.fsum(halves)) / last
    # The top is set, not summed, so that the length is exactly what the file says.
    return (*accumulate((gap + half for half in halves[:-1]), initial=0.0), length)


def are_apart(
    section: Section, heights: tuple[float, ...], widths: tuple[float, ...], rise: float
) -> bool:
    """Check that no two neighbours overlap as seen from the side, nor touch with their ends.

    Parameters
    ----------
    section
        The chain, where a fault is noted.
    heights, widths
        Of the rods, m, bottom up; shape ``(rods,)``.
    rise
        Of one end of a tilted rod over the other, m; 0 where unknown.
    """
    key = "length" if "length" in section else "spacing"
    for rod, ((low, high), (lower, upper)) in enumerate(
        zip(pairwise(heights), pairwise(widths), strict=True), start=1
    ):
        pitch, needed = high - low, (lower + upper) / 2
        if not pitch > needed:
            apart, thick = (format_quantity(Quantity(x), "mm") for x in (pitch, needed))
            message = f"rods {rod} and {rod + 1} overlap: {apart} apart but {thick} thick"
            section.fault(key, message)
            return False
        if rise >= pitch:
            height = format_quantity(Quantity(rise), "mm")
            message = f"tilted ends rise {height}, so rods {rod} and {rod + 1} would touch"
            section.fault("rod_length", message)
            return False
    return True
