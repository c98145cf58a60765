"""The ``masses`` of a chain: rod by rod, or along a profile."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from rig.protocol import fields
from rig.protocol.fields import Range, Section
from rig.protocol.rods import MASS
from rig.protocol.yamltree import Sequence
from rig.units import Dimension

if TYPE_CHECKING:
    from rig.protocol.fields import Converter, FieldFaults
    from rig.protocol.yamltree import Node

HEIGHT = Range(Dimension.LENGTH, 0.0, 100.0, "m")
_PROFILES = ("exponential", "table")

Masses = tuple[float, ...]


def read_masses(heights: tuple[float, ...]) -> Converter[Masses]:
    """Return the converter to the mass of each rod, kg, bottom up.

    Parameters
    ----------
    heights
        Of the rods' middles above the bottom rod's, m.

    Returns
    -------
    Converter
        From a list with one mass a rod; from ``{exponential: {bottom: …, top: …}}``, an even
        ratio from each rod to the next; or from ``{table: [{height: …, mass: …}, …]}``, straight
        from point to point.
    """

    def convert(node: Node, key: str, faults: FieldFaults) -> Masses | None:
        if isinstance(node, Sequence):
            return _listed(node, key, faults, len(heights))
        inner = fields.mapping(node, key, faults)
        if inner is None:
            return None
        section = Section(inner, key, faults, _PROFILES)
        given = [name for name in _PROFILES if name in section]
        if len(given) != 1:
            wanted = "exponential: {bottom: 12 g, top: 3 g} or table: [{height: 0 mm, mass: 12 g}]"
            if not section.strange:
                section.refuse(f"state one profile, {wanted}")
            return None
        if given == ["exponential"]:
            return section.take("exponential", _exponential(len(heights)))
        return section.take("table", _table(heights))

    return convert


def _listed(node: Sequence, key: str, faults: FieldFaults, rods: int) -> Masses | None:
    """Convert one mass a rod."""
    if len(node.items) != rods:
        message = f"found {len(node.items)} masses for {rods} rods; state one for each rod"
        faults.add(node.place, key, message)
        return None
    convert = fields.exact(MASS)
    found = [convert(item, f"{key}[{i}]", faults) for i, item in enumerate(node.items)]
    masses = tuple(mass for mass in found if mass is not None)
    return masses if len(masses) == rods else None


def _exponential(rods: int) -> Converter[Masses]:
    """Return the converter from the masses of the two end rods."""

    @fields.of_keys("bottom", "top")
    def convert(section: Section) -> Masses | None:
        bottom = section.take("bottom", fields.exact(MASS), required="12 g")
        top = section.take("top", fields.exact(MASS), required="3 g")
        if bottom is None or top is None:
            return None
        between = ((top / bottom) ** (rod / (rods - 1)) for rod in range(1, rods - 1))
        return (bottom, *(bottom * share for share in between), top)

    return convert


def _table(heights: tuple[float, ...]) -> Converter[Masses]:
    """Return the converter from points between which the mass of a rod runs straight."""

    def convert(node: Node, key: str, faults: FieldFaults) -> Masses | None:
        listed = fields.sequence(node, key, faults)
        if listed is None:
            return None
        points = [_point(item, f"{key}[{i}]", faults) for i, item in enumerate(listed.items)]
        known = [point for point in points if point is not None]
        if len(known) < len(points):
            return None
        zs = [height for height, _ in known]
        for i, (low, high) in enumerate(pairwise(zs), start=1):
            if low >= high:
                message = "heights must increase from point to point"
                faults.add(listed.items[i].place, f"{key}[{i}]", message)
                return None
        # A height that sums up from rods is a rounding above what was written.
        if zs[0] > 0.0 or zs[-1] < heights[-1] * (1.0 - 1e-12):
            message = (
                f"runs from {zs[0]:g} m to {zs[-1]:g} m; the rods are from 0 m to {heights[-1]:g} m"
            )
            faults.add(listed.place, key, message)
            return None
        return tuple(_between(known, height) for height in heights)

    return convert


@fields.of_keys("height", "mass")
def _point(section: Section) -> tuple[float, float] | None:
    """Convert one line of the table."""
    height = section.take("height", fields.exact(HEIGHT), required="0 mm")
    mass = section.take("mass", fields.exact(MASS), required="12 g")
    return None if height is None or mass is None else (height, mass)


def _between(points: list[tuple[float, float]], height: float) -> float:
    """Mass at a height that the points enclose."""
    for (z, mass), (upper_z, upper_mass) in pairwise(points):
        if height <= upper_z:
            share = (height - z) / (upper_z - z)
            return mass * (1.0 - share) + upper_mass * share
    return points[-1][1]
