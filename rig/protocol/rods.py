"""The rods of a chain: diameters, masses and heights."""

from __future__ import annotations

import math
from itertools import accumulate, pairwise
from typing import Any

from rig.protocol.fields import Section
from rig.protocol.keys import MOST_RODS
from rig.units import Quantity, format_quantity

RodValues = tuple[float, ...]
"""A value for each rod, bottom up."""


def count_rods(section: Section) -> int:
    """Return the number of rods of a chain whose ``rods`` are sound."""
    rods = section["rods"]
    return rods if isinstance(rods, int) else sum(group["count"] for group in rods)


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
    diameters, masses = (_list_values(section, key, total) for key in ("diameter", "mass"))
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


def _list_values(section: Section, key: str, total: int) -> list[Any]:
    """Return the value of each rod from its group or the chain, bottom up; `None` if missing."""
    groups = section["rods"]
    if isinstance(groups, int):
        return [section[key]] * total
    values = ((group["count"], group[key]) for group in groups)
    return [
        section[key] if value is None else value for count, value in values for _ in range(count)
    ]


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
    halves = [(lower + upper) / 2 for lower, upper in pairwise(diameters)]
    gap = (length - math.fsum(halves)) / last
    # The top is set, not summed, so that the length is exactly what the file says.
    return (*accumulate((gap + half for half in halves[:-1]), initial=0.0), length)


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
