"""The ``gates`` of a protocol, and whether each beam is clear before the release."""

import math
from collections.abc import Collection, Iterable, Iterator
from typing import NamedTuple

from rig.protocol.contact import touching_heights
from rig.protocol.fields import Section
from rig.protocol.protocol import SIDES, RodChain, vocabulary_of
from rig.units import Quantity

CLEARANCE_M = 0.001
"""Least margin around a rod, m: a beam is some millimetres wide, and a hanging chain sways."""


def check_sides(section: Section, *, surface: bool, chains: int) -> None:
    """Note sides that a scene does not have or that lack gates, and gates of one channel or place.

    Parameters
    ----------
    section
        The ``gates`` mapping.
    surface
        Whether the scene has a surface.
    chains
        Number of chains in the scene.
    """
    if surface:
        section.need("impact")
    else:
        section.refuse("the scene has no surface; put the gates under free", "impact")
    if surface and chains == 1:
        section.refuse("the only chain strikes the surface; put the gates under impact", "free")
    elif not surface or chains > 1:
        section.need("free")
    lines: dict[object, int] = {}
    for side, gate in _sections(section):
        channel, height = gate["channel"], gate["height"]
        gate_values = {
            "channel": (channel, f"channel {channel} is already used"),
            "height": (height and (side, height), "a gate of this side is already there,"),
        }
        for key, (value, message) in gate_values.items():
            if value in lines:
                gate.fault(key, f"{message} on line {lines[value]}")
            elif value is not None:
                lines[value] = gate.place(key).line


def _sections(section: Section) -> Iterator[tuple[str, Section]]:
    """Return the side and the mapping of each gate, in the order of the file's keys."""
    return ((side, gate) for side in SIDES for gate in section[side] or () if gate)


class HangingRod(NamedTuple):
    """A rod before the release: the heights between which it blocks a beam, m."""

    low: float
    high: float
    number: int
    chain: str


def hanging_rods(chains: Iterable[RodChain], drop: Quantity) -> list[HangingRod]:
    """Return all hanging rods, sorted by the lower end of their shadow."""
    rods = []
    for chain in chains:
        places = zip(chain.chain.heights, chain.widths, strict=True)
        for number, (height, width) in enumerate(places, start=1):
            z, half = drop.value + height, width / 2 + max(CLEARANCE_M, drop.u)
            rods.append(HangingRod(z - half, z + half, number, chain.name))
    return sorted(rods)


def blocking_rod(rods: Iterable[HangingRod], height: float) -> HangingRod | None:
    """Return the first of some rods that blocks a beam at a height."""
    return next((rod for rod in rods if rod.low < height < rod.high), None)


def check_clear(top: Section, chains: Collection[RodChain], inclines: Iterable[float]) -> None:
    """Note gates that are blocked before the release, that no rod passes, or that are too low.

    The chains swap sides, so every gate is checked against every chain.

    Parameters
    ----------
    top
        The root of the file, with its ``gates`` and a sound ``drop``.
    inclines
        Inclines of the board, if heights are measured from it.
    """
    drop, struck = top["drop"], "surface" in top
    rods = hanging_rods(chains, drop)
    touching = [max(touching_heights(chain, angle)) for angle in inclines for chain in chains]
    thickest = max(width for chain in chains for width in chain.widths)
    lowest = thickest / 2 + max(touching, default=0.0) if struck else 0.0
    top_rod = min(drop.value + chain.chain.length for chain in chains)
    part = vocabulary_of(chains, struck=struck).part
    only = next(iter(chains)).name if all(chain.chain.rods == 1 for chain in chains) else None
    for gate in (gate for _, gate in _sections(top["gates"]) if gate.is_sound()):
        height = gate["height"]
        rod = blocking_rod(rods, height)
        if height < lowest:
            least = _mm(math.ceil(lowest * 1e4) / 1e4)
            why = f"; a rod at rest on the surface would block the beam: at least {least} is needed"
        elif rod is not None:
            clear = " or ".join(_mm(z) for z in _clear_heights(height, rods, lowest, top_rod))
            blocking = only or f"{part} {rod.number} of {rod.chain}"
            why = f", which {blocking} blocks before the release"
            why += f"; the nearest clear heights are {clear}" if clear else ""
        elif height > top_rod:
            passes = f"{only} does not pass" if only else f"no {part} passes"
            start = "it starts" if only else f"the top {part} starts"
            why = f"; {passes} above {_mm(top_rod)}, where {start}"
        else:
            continue
        gate.fault("height", f"found {_mm(height)}{why}")


def _clear_heights(
    height: float, rods: Iterable[HangingRod], lowest: float, top: float
) -> list[float]:
    """Return the nearest heights below and above that no rod blocks, to 0.1 mm."""
    edges = [edge for rod in rods for edge in (rod.low, rod.high)]
    # A rounded edge may lie inside its rod by a rounding error: the next step is outside.
    near = {(math.floor(edge * 1e4) + step) / 1e4 for edge in edges for step in (-1, 0, 1, 2)}
    clear = [z for z in sorted(near) if blocking_rod(rods, z) is None]
    nearest = [z for z in clear if z < height][-1:] + [z for z in clear if z > height][:1]
    return [z for z in nearest if max(lowest, 1e-4) <= z <= top]


def _mm(height: float) -> str:
    """Return a height as text, to 0.1 mm."""
    return f"{height * 1e3:.1f} mm"
