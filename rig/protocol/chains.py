"""The ``chains`` of a protocol: masses, heights and widths from the description of rods."""

import math
from collections.abc import Collection
from contextlib import suppress
from typing import Any

from rig.model.chain import XI, Chain
from rig.protocol.fields import Section, UnsoundError, join, read_value, unique_entries
from rig.protocol.keys import Plain
from rig.protocol.protocol import RodChain
from rig.protocol.rods import check_apart, count_rods, list_rods, place_masses, place_rods
from rig.protocol.yamltree import Mapping, Sequence
from rig.units import did_you_mean, quote

_LONGEST_NAME = 32


def read_chains(top: Section) -> dict[str, RodChain | None]:
    """Read the ``chains`` mapping.

    Parameters
    ----------
    top
        The root of the file: gates need the rods' diameters, and a single rod strikes no surface.

    Returns
    -------
    dict of str to RodChain or None
        In file order; ``None`` for a faulty chain.
    """
    node, faults = top["chains"], top.faults
    if node is None:
        return {}
    places, nodes = unique_entries(node, "chains", faults)
    if not 1 <= len(nodes) <= 2:
        faults.add(node.place, "chains", f"found {len(nodes)} chains; one or two are accepted")
    for name, place in places.items():
        if not name.isidentifier() or len(name) > _LONGEST_NAME:
            message = "this name needs to be one word of letters and digits, such as A"
            faults.add(place, join("chains", name), message)
    described = {name: own for name, own in nodes.items() if isinstance(own, Mapping)}
    likes: dict[str, Any] = {name: own.get("like") for name, own in described.items()}
    bases = {name: like for name, like in likes.items() if getattr(like, "kind", "") == "text"}
    chains: dict[str, RodChain | None] = {}
    for name in sorted(nodes, key=bases.__contains__):
        own, path = nodes[name], join("chains", name)
        if name in bases:
            base = bases[name].text
            message = _base_problem(base, chains, [chain for chain in nodes if chain != name])
            if message:
                faults.add(bases[name].place, f"{path}.like", message)
            others, partial = described.get(base, Mapping(node.place, [])), chains.get(base) is None
            own = _inherit(described[name], others, partial=partial)
        section: Section | None = read_value(Plain.MAPPED, own, path, "chains.*", faults)
        chains[name] = None
        with suppress(UnsoundError):
            chains[name] = _build_chain(name, section, top) if section else None
    return {name: chains[name] for name in nodes}


def _base_problem(base: str, read: Collection[str], candidates: list[str]) -> str:
    """Return why a chain cannot be `like` another; empty if it can."""
    if base not in candidates:
        accepted = ", ".join(map(quote, candidates)) or "no other chain is there"
        return f"found {quote(base)}; {did_you_mean(base, candidates)}accepted: {accepted}"
    return "" if base in read else "like refers back to itself; describe one chain in full"


def _inherit(own: Mapping, base: Mapping, *, partial: bool) -> Mapping:
    """Return a chain's own entries, then those of its base that it does not override."""
    hidden = {"like", *(getattr(key, "text", None) for key, _ in own.entries)}
    if hidden & {"mass", "masses"}:
        hidden |= {"mass", "masses"}
    if isinstance(own.get("spacing"), Sequence):
        hidden.add("length")
    if "length" in hidden and isinstance(base.get("spacing"), Sequence):
        hidden.add("spacing")
    entries = [entry for entry in base.entries if getattr(entry[0], "text", None) not in hidden]
    return Mapping(own.place, [*own.entries, *entries], partial)


def _build_chain(name: str, section: Section, top: Section) -> RodChain:
    """Build a chain from its keys.

    Raises
    ------
    UnsoundError
        A key is faulty or does not fit others; the fault is noted.
    """
    is_object = section.is_sound("rods") and count_rods(section) == 1 and "surface" not in top
    if is_object:
        section.refuse("one object has no {}; leave it out", "length", "spacing")
    elif not isinstance(section.nodes.get("spacing"), Sequence):
        section.need("length")
    else:
        section.refuse("follows from the listed spacing; leave it out", "length")
    diameters, masses, weighed = list_rods(section, top)
    if weighed:
        section.refuse("mass is also given; keep one of them", "masses")
    section.require_sound("length", "spacing")
    heights = place_rods(section, diameters)
    section.require_sound("tilt", "rod_length")
    tilt, rod_length = section["tilt"], section["rod_length"] or 0.0
    widths = tuple(diameter / math.cos(math.radians(tilt)) for diameter in diameters)
    check_apart(section, heights, widths, rod_length * math.sin(math.radians(tilt)))
    if "masses" in section:
        masses, weighed = place_masses(section, heights), True
    section.require_sound()
    inertia, alpha, gamma = XI * section["inertia"], section["alpha"], section["gamma"]
    chain = Chain(masses, heights, inertia, alpha=alpha, gamma=gamma)
    position_u, width_u = section["position_uncertainty"], section["width_uncertainty"]
    if is_object and "position_uncertainty" not in section:
        position_u = 0.0  # the drop height gives its place
    return RodChain(name, chain, widths, tilt, position_u, width_u, diameters, rod_length, weighed)
