"""The ``chains`` of a protocol: from rods as people describe them to masses, heights and widths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.model.chain import UNIFORM_ROD_INERTIA, XI, Chain
from rig.protocol import fields
from rig.protocol.fields import Range, Section
from rig.protocol.protocol import RodChain
from rig.protocol.rods import Rods, read_rods
from rig.protocol.spacing import Spacing, fits, place_rods, read_spacing
from rig.protocol.yamltree import Mapping, Node, Sequence
from rig.units import Dimension, Quantity, quoted

if TYPE_CHECKING:
    from rig.protocol.fields import FieldFaults
    from rig.protocol.yamltree import Place

CHAIN_KEYS = (
    "like", "rods", "length", "diameter", "mass", "masses", "rod_length", "tilt", "spacing",
    "inertia", "alpha", "gamma", "position_uncertainty", "width_uncertainty",
)  # fmt: skip
LENGTH = Range(Dimension.LENGTH, 1e-3, 100.0, "m")
ROD_LENGTH = Range(Dimension.LENGTH, 1e-6, 10.0, "m")
UNCERTAINTY = Range(Dimension.LENGTH, 0.0, 0.1, "mm")
TILT = Range(Dimension.ANGLE, 0.0, 80.0, "deg")
INERTIA = Range(Dimension.NUMBER, 0.0, 0.25, "1", open_low=True)
"""In units of m L²: all mass in the middle, to half of it at each end."""
ALPHA = Range(Dimension.NUMBER, 0.0, 1.0, "1")
GAMMA = Range(Dimension.NUMBER, 0.0, 1e6, "1")
_LONGEST_NAME = 32


@dataclass(frozen=True, slots=True)
class _Described:
    """A chain's mapping with what it inherits already in it."""

    node: Mapping
    base: str | None
    given_name: Place


def read_chains(
    node: Node, faults: FieldFaults, *, seen_by_gates: bool, struck: bool
) -> dict[str, RodChain] | None:
    """Read the ``chains`` mapping.

    Parameters
    ----------
    node
        The value of ``chains``.
    faults
        Where problems go.
    seen_by_gates
        Whether light beams measure the rods, so that their diameters are needed.
    struck
        Whether there is a surface, which one rod alone does not strike.

    Returns
    -------
    dict of str to RodChain, or None
        In file order; ``None`` if any chain is faulty.
    """
    outer = fields.mapping(node, "chains", faults)
    if outer is None:
        return None
    _, entries = fields.unique_entries(outer, "chains", faults)
    described = {name: _named(outer, name, value, faults) for name, value in entries.items()}
    if not 1 <= len(entries) <= 2:
        faults.add(outer.place, "chains", f"found {len(entries)} chains; one or two are accepted")
    built: dict[str, RodChain | None] = {}
    for name in _bases_first(described, faults):
        one = described[name]
        if one is None:
            built[name] = None
            continue
        inherited = _inherit(one, described)
        lenient = one.base is not None and built.get(one.base) is None
        section = Section(inherited, fields.join("chains", name), faults, CHAIN_KEYS,
                          lenient=lenient)  # fmt: skip
        built[name] = _chain(name, section, seen_by_gates=seen_by_gates, struck=struck)
    result = {name: chain for name in entries if (chain := built.get(name)) is not None}
    return result if result and len(result) == len(entries) else None


def _named(outer: Mapping, name: str, node: Node, faults: FieldFaults) -> _Described | None:
    """Check a chain's name and the name behind its ``like``."""
    path = fields.join("chains", name)
    place = next(key.place for key, _ in outer.entries if getattr(key, "text", None) == name)
    if not name.isidentifier() or len(name) > _LONGEST_NAME:
        faults.add(place, path, "this name needs to be one word of letters and digits, such as A")
    inner = fields.mapping(node, path, faults)
    if inner is None:
        return None
    for key, value in inner.entries:
        if getattr(key, "text", None) == "like":
            base = fields.string(value, f"{path}.like", faults)
            return _Described(inner, base, value.place)
    return _Described(inner, None, inner.place)


def _bases_first(described: dict[str, _Described | None], faults: FieldFaults) -> list[str]:
    """Order the names so that a chain comes after the one it is like; drop what cannot be."""
    order: list[str] = []
    for name, one in described.items():
        if one is None or one.base is None:
            order.append(name)
    for name, one in described.items():
        if one is None or one.base is None:
            continue
        path = f"{fields.join('chains', name)}.like"
        others = tuple(other for other in described if other != name)
        if one.base not in others:
            close = fields.did_you_mean(one.base, others)
            accepted = ", ".join(map(quoted, others)) or "no other chain is there"
            message = f"found {quoted(one.base)}; {close}accepted: {accepted}"
            faults.add(one.given_name, path, message)
        elif one.base not in order:
            message = "like refers back to itself; describe one chain in full"
            faults.add(one.given_name, path, message)
        order.append(name)
    return order


def _inherit(one: _Described, described: dict[str, _Described | None]) -> Mapping:
    """Return the chain's own entries, then those of its base that it does not override."""
    base = described.get(one.base) if one.base is not None else None
    if base is None or base is one:
        return one.node
    own = {getattr(key, "text", None) for key, _ in one.node.entries}
    taken: set[str | None] = set(own) | {"like"}
    taken |= _displaced(one.node, base.node)
    entries = list(one.node.entries)
    for key, value in base.node.entries:
        text = getattr(key, "text", None)
        if text not in taken:
            taken.add(text)
            entries.append((key, value))
    return Mapping(one.node.place, entries, one.node.size)


def _displaced(own: Mapping, base: Mapping) -> set[str | None]:
    """Keys of the base that would contradict the chain's own."""
    mine, theirs = (
        {getattr(key, "text", None): value for key, value in node.entries} for node in (own, base)
    )
    gone: set[str | None] = set()
    for one, other in (("mass", "masses"), ("masses", "mass")):
        if one in mine:
            gone.add(other)
    if isinstance(mine.get("spacing"), Sequence):
        gone.add("length")
    if "length" in mine and isinstance(theirs.get("spacing"), Sequence):
        gone.add("spacing")
    return gone


def _chain(name: str, section: Section, *, seen_by_gates: bool, struck: bool) -> RodChain | None:
    """Build one chain from its fields."""
    rods = read_rods(section, seen_by_gates=seen_by_gates, struck=struck)
    spacing = section.take("spacing", read_spacing, Spacing())
    length: float | None
    if rods is not None and len(rods.diameters) == 1:
        length = 0.0
        for key in (key for key in ("length", "spacing") if key in section):
            section.fault(key, f"one object has no {key}; leave it out", at_key=True)
    elif isinstance(section.values.get("spacing"), Sequence):
        length = math.nan
        if "length" in section:
            section.fault("length", "follows from the listed spacing; leave it out", at_key=True)
    else:
        length = section.take("length", fields.exact(LENGTH), required="1165 mm")
    rod_length = section.take("rod_length", fields.exact(ROD_LENGTH), math.nan)
    tilt = section.take("tilt", fields.exact(TILT), 0.0)
    inertia = section.take("inertia", fields.exact(INERTIA), UNIFORM_ROD_INERTIA / XI)
    alpha = section.take("alpha", fields.quantity(ALPHA), Quantity(math.nan))
    gamma = section.take("gamma", fields.exact(GAMMA), math.nan)
    alone = length == 0.0  # and is where its drop says
    usual = 0.0 if alone else 0.0003
    position_u = section.take("position_uncertainty", fields.exact(UNCERTAINTY), usual)
    width_u = section.take("width_uncertainty", fields.exact(UNCERTAINTY), 0.0001)
    if rods is None or length is None or rod_length is None or tilt is None or spacing is None:
        return None
    if inertia is None or alpha is None or gamma is None or position_u is None or width_u is None:
        return None
    widths = tuple(d / math.cos(math.radians(tilt)) for d in rods.diameters)
    heights = place_rods(section, rods.diameters, length, spacing)
    if heights is None:
        return None
    if not fits(section, heights, widths, rod_length * math.sin(math.radians(tilt))):
        return None
    masses = _masses(section, rods, heights)
    if masses is None:
        return None
    chain = Chain(
        masses=masses,
        heights=heights,
        inertia=XI * inertia,
        alpha=None if math.isnan(alpha.value) else alpha,
        gamma=None if math.isnan(gamma) else gamma,
    )
    return RodChain(
        name, chain, widths, tilt, position_u, width_u, rods.diameters, rod_length,
        weighed=rods.weighed or "masses" in section,
    )  # fmt: skip


def _masses(section: Section, rods: Rods, heights: tuple[float, ...]) -> tuple[float, ...] | None:
    """Return the masses, `None` if they are faulty."""
    if "masses" not in section:
        return rods.masses
    if rods.weighed:
        section.fault("masses", "mass is also given; keep one of them", at_key=True)
        return None
    from rig.protocol.masses import read_masses  # noqa: PLC0415 - few chains list theirs

    return section.take("masses", read_masses(heights))
