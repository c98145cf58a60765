"""The ``rods`` of a chain: a number of like rods, or single rods and groups from the bottom up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.protocol import fields
from rig.protocol.fields import Range, Section
from rig.protocol.yamltree import ScalarNode
from rig.units import Dimension

if TYPE_CHECKING:
    from rig.protocol.fields import FieldFaults
    from rig.protocol.yamltree import Node, Sequence

DIAMETER = Range(Dimension.LENGTH, 1e-6, 1.0, "mm")
MASS = Range(Dimension.MASS, 1e-9, 1000.0, "kg")
MOST_RODS = 1000


@dataclass(frozen=True, slots=True)
class Rods:
    """Diameter (m; 0 where unknown) and mass of each rod, bottom up.

    `weighed` says that masses are in kg; else only their ratios mean something.
    """

    diameters: tuple[float, ...]
    masses: tuple[float, ...]
    weighed: bool


@dataclass(frozen=True, slots=True)
class _Group:
    """Like rods, with NaN-free optionals: ``None`` where the file says nothing."""

    count: int
    diameter: float | None
    mass: float | None


def read_rods(section: Section, *, seen_by_gates: bool, struck: bool) -> Rods | None:
    """Read ``rods``, and ``diameter`` and ``mass`` common to them, from a chain's section.

    Masses are those given, else proportional to the cross-section (like material) with the
    bottom rod's as 1, else all 1. One rod alone is any object, which may fall and never strikes.
    """
    common = section.take("diameter", fields.exact(DIAMETER))
    each = section.take("mass", fields.exact(MASS))
    groups = section.take("rods", _groups, required="25")
    if groups is None or ("diameter" in section and common is None):
        return None
    if "mass" in section and each is None:
        return None
    total = sum(group.count for group in groups)
    if total > MOST_RODS:
        section.fault("rods", f"found {total} rods; at most {MOST_RODS} are accepted")
        return None
    if total == 1 and struck:
        message = "found 1 rod; a chain that strikes a surface has at least 2"
        section.fault("rods", f"{message}; for one object leave surface out")
        return None
    weights = [each if group.mass is None else group.mass for group in groups]
    if len({mass is None for mass in weights}) > 1:
        section.fault("rods", "mass is given for some groups only; state it for all or none")
        return None
    known = [common if group.diameter is None else group.diameter for group in groups]
    if None in known and (seen_by_gates or any(d is not None for d in known)):
        section.take("diameter", fields.exact(DIAMETER), required="12.7 mm")
        return None
    diameters = [0.0 if d is None else d for d in known]
    masses = [
        mass if mass is not None else (d / diameters[0]) ** 2 if diameters[0] else 1.0
        for mass, d in zip(weights, diameters, strict=True)
    ]
    counts = [group.count for group in groups]
    return Rods(_spread(diameters, counts), _spread(masses, counts), None not in weights)


def _spread(values: list[float], counts: list[int]) -> tuple[float, ...]:
    """Repeat each group's value for each of its rods."""
    return tuple(v for v, count in zip(values, counts, strict=True) for _ in range(count))


def _groups(node: Node, key: str, faults: FieldFaults) -> list[_Group] | None:
    """Convert a number of rods, or a list of groups."""
    if isinstance(node, ScalarNode):
        count = fields.whole(1, MOST_RODS)(node, key, faults)
        return None if count is None else [_Group(count, None, None)]
    items: Sequence | None = fields.sequence(node, key, faults)
    if items is None:
        return None
    groups = [_group(item, f"{key}[{i}]", faults) for i, item in enumerate(items.items)]
    found = [group for group in groups if group is not None]
    return found if len(found) == len(groups) else None


@fields.of_keys("count", "diameter", "mass")
def _group(section: Section) -> _Group | None:
    """Convert one group."""
    count = section.take("count", fields.whole(1, MOST_RODS), 1)
    diameter = section.take("diameter", fields.exact(DIAMETER))
    mass = section.take("mass", fields.exact(MASS))
    if count is None or any(
        name in section and value is None
        for name, value in (("diameter", diameter), ("mass", mass))
    ):
        return None
    return _Group(count, diameter, mass)
