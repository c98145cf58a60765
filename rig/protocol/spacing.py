"""Where the rods of a chain hang: evenly, or at listed distances."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

from rig.protocol import fields
from rig.protocol.fields import Range
from rig.protocol.yamltree import Sequence
from rig.units import Dimension, Quantity, format_quantity

if TYPE_CHECKING:
    from rig.protocol.fields import FieldFaults, Section
    from rig.protocol.yamltree import Node

GAP = Range(Dimension.LENGTH, 1e-6, 10.0, "m")
_RULES = ("equal-pitch", "equal-gaps")


@dataclass(frozen=True, slots=True)
class Spacing:
    """A rule, or the distance from each rod's middle to the next, m, bottom up."""

    rule: str = _RULES[0]
    gaps: tuple[float, ...] = ()


def read_spacing(node: Node, key: str, faults: FieldFaults) -> Spacing | None:
    """Convert a rule or a list of distances."""
    if not isinstance(node, Sequence):
        rule = fields.choice(*_RULES)(node, key, faults)
        return None if rule is None else Spacing(rule)
    convert = fields.exact(GAP)
    found = [convert(item, f"{key}[{i}]", faults) for i, item in enumerate(node.items)]
    gaps = tuple(gap for gap in found if gap is not None)
    return Spacing("listed", gaps) if len(gaps) == len(found) else None


def place_rods(
    section: Section, diameters: tuple[float, ...], length: float, spacing: Spacing
) -> tuple[float, ...] | None:
    """Return the heights of the rods' middles above the bottom rod's, m.

    Equal gaps: neighbours i, i+1 are ``gap + (d_i + d_{i+1})/2`` apart, the gap being whatever
    makes the whole chain `length` long.

    Parameters
    ----------
    section
        The chain, where a wrong number of distances is noted.
    diameters
        Of the rods, m, bottom up; shape ``(rods,)``.
    length
        Of the chain, m; not used where distances are listed.
    spacing
        How the rods are spread over it.

    Returns
    -------
    tuple of float or None
        Shape ``(rods,)``; `None` if there is a fault.
    """
    last = len(diameters) - 1
    if last == 0:
        return (0.0,)
    if spacing.rule == "listed":
        if len(spacing.gaps) != last:
            message = f"found {len(spacing.gaps)} distances; {last} are between {last + 1} rods"
            section.fault("spacing", message)
            return None
        return tuple(accumulate(spacing.gaps, initial=0.0))
    if spacing.rule == "equal-pitch":
        return tuple(length * rod / last for rod in range(last + 1))
    halves = [(lower + upper) / 2 for lower, upper in pairwise(diameters)]
    gap = (length - math.fsum(halves)) / last
    # The top is set, not summed, so that the length is exactly what the file says.
    return (*accumulate((gap + half for half in halves[:-1]), initial=0.0), length)


def fits(
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
        Of one end of a tilted rod over the other, m; NaN where unknown.
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
        if rise >= pitch:  # never true of an unknown rod length, which is a NaN
            shown = format_quantity(Quantity(rise), "mm")
            message = f"tilted ends rise {shown}, so rods {rod} and {rod + 1} would touch"
            section.fault("rod_length", message)
            return False
    return True
