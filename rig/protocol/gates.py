"""The ``gates`` of a protocol, and whether each beam is clear before the release."""

from __future__ import annotations

import math
from itertools import count
from typing import TYPE_CHECKING

from rig.boards import GATES
from rig.protocol import fields
from rig.protocol.contact import touching_heights
from rig.protocol.fields import Range, Section
from rig.protocol.protocol import DATUM_U, SIDES, Gate, Gates, RodChain, Side, vocabulary_of
from rig.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rig.protocol.fields import FieldFaults
    from rig.protocol.yamltree import Node, Place
    from rig.units import Quantity

HEIGHT = Range(Dimension.LENGTH, 0.0, 100.0, "m", open_low=True)
HEIGHT_UNCERTAINTY = Range(Dimension.LENGTH, 0.0, 0.1, "mm")
CLEARANCE_M = 0.001
"""A beam is some millimetres wide and a hanging chain sways: the least margin around a rod, m."""
_COMMON_U = "state the uncertainty of all gates as height_uncertainty"

Located = tuple[Gate, "Place", str]


def read_gates(
    node: Node, faults: FieldFaults, *, surface: bool, chains: int
) -> tuple[Gates, list[Located]] | None:
    """Read the ``gates`` mapping.

    Parameters
    ----------
    node
        The value of ``gates``.
    faults
        Where problems go.
    surface
        Whether the scene has a surface.
    chains
        Number of chains in the scene.

    Returns
    -------
    tuple of Gates and list, or None
        The gates, and each gate with the place and key of its height for `check_clear`.
    """
    outer = fields.mapping(node, "gates", faults)
    if outer is None:
        return None
    section = Section(outer, "gates", faults, (*SIDES, "height_uncertainty", "datum_uncertainty"))
    if "impact" in section and not surface:
        message = "the scene has no surface; put the gates under free"
        section.fault("impact", message, at_key=True)
    if "free" in section and surface and chains == 1:
        message = "the only chain strikes the surface; put the gates under impact"
        section.fault("free", message, at_key=True)
    needed = {"impact": surface, "free": not surface or chains > 1}
    used: dict[int, int] = {}
    located: list[Located] = []
    for side in SIDES:
        example = "[{channel: 0, height: 25 mm}]" if needed[side] else ""
        listed = section.take(side, fields.sequence, required=example)
        for i, item in enumerate(listed.items if listed else ()):
            gate = _gate(item, f"gates.{side}[{i}]", faults, side, used)
            if gate is not None:
                located.append(gate)
    height_u = section.take("height_uncertainty", fields.exact(HEIGHT_UNCERTAINTY), 0.0003)
    datum_u = section.take("datum_uncertainty", fields.exact(HEIGHT_UNCERTAINTY), DATUM_U)
    if height_u is None or datum_u is None:
        return None
    return Gates(tuple(gate for gate, _, _ in located), height_u, datum_u), located


def _gate(
    node: Node, key: str, faults: FieldFaults, side: Side, used: dict[int, int]
) -> Located | None:
    """Read one gate; `used` maps each channel taken so far to its line."""
    inner = fields.mapping(node, key, faults)
    if inner is None:
        return None
    section = Section(inner, key, faults, ("channel", "height"))
    channel = section.take("channel", fields.whole(0, GATES - 1), required="0")
    height = section.take("height", fields.exact(HEIGHT, _COMMON_U), required="25 mm")
    if channel is not None:
        line = section.place("channel").line
        if channel in used:
            message = f"channel {channel} is already used on line {used[channel]}"
            section.fault("channel", message)
        used.setdefault(channel, line)
    if channel is None or height is None:
        return None
    return Gate(channel, height, side), section.place("height"), section.key("height")


def check_clear(
    located: Iterable[Located],
    chains: Iterable[RodChain],
    drop: Quantity,
    faults: FieldFaults,
    *,
    surface: bool,
    inclines: Sequence[float] = (),
) -> None:
    """Note gates that are blocked before the release, that nothing passes, or that are too low.

    The chains swap sides, so every gate is checked against every chain.

    Parameters
    ----------
    inclines
        Of the board, where heights are measured from it.
    """
    chains = tuple(chains)
    blocked = sorted(
        (z - half, z + half, rod, chain.name)
        for chain in chains
        for rod, (height, width) in enumerate(
            zip(chain.chain.heights, chain.widths, strict=True), start=1
        )
        for z, half in ((drop.value + height, width / 2 + max(CLEARANCE_M, drop.u)),)
    )
    lowest = max(width for chain in chains for width in chain.widths) / 2 if surface else 0.0
    lowest += max(
        (max(touching_heights(chain, incline)) for chain in chains for incline in inclines),
        default=0.0,
    )
    top = min(drop.value + chain.chain.length for chain in chains)
    spans = [(low, high) for low, high, _, _ in blocked]
    part = vocabulary_of(chains, struck=surface).part
    alone = chains[0].name if all(chain.chain.rods == 1 for chain in chains) else None
    for gate, place, key in located:
        height = gate.height
        hit = next((b for b in blocked if b[0] < height < b[1]), None)
        if height < lowest:
            message = (
                f"found {_mm(height)}; a rod at rest on the surface would block the beam: "
                f"at least {_mm(math.ceil(lowest * 1e4) / 1e4)} is needed"
            )
            faults.add(place, key, message)
        elif hit is not None:
            near = " or ".join(_mm(h) for h in _clear(height, spans, lowest, top))
            free = f"; the nearest clear heights are {near}" if near else ""
            rod = f"{part} {hit[2]} of {hit[3]}" if alone is None else alone
            message = f"found {_mm(height)}, which {rod} blocks before "
            faults.add(place, key, f"{message}the release{free}")
        elif height > top:
            what = f"no {part} passes" if alone is None else f"{alone} does not pass"
            where = f"the top {part} starts" if alone is None else "it starts"
            message = f"found {_mm(height)}; {what} above {_mm(top)}, where {where}"
            faults.add(place, key, message)


def _clear(
    height: float, spans: list[tuple[float, float]], lowest: float, top: float
) -> list[float]:
    """Return the nearest heights below and above that no rod blocks, to 0.1 mm."""
    found = []
    for rounding, step in ((math.floor, -1), (math.ceil, 1)):
        # Walk from edge to edge; each step leaves at least one span behind, so this ends.
        tenths = rounding(height * 1e4)
        for _ in count():
            at = tenths / 1e4
            hit = next((span for span in spans if span[0] < at < span[1]), None)
            if hit is None:
                break
            edge = rounding(hit[0 if step < 0 else 1] * 1e4)
            tenths = edge if edge != tenths else tenths + step
        if max(lowest, 1e-4) <= tenths / 1e4 <= top:
            found.append(tenths / 1e4)
    return found


def _mm(height: float) -> str:
    """Write a height as people set it, to 0.1 mm."""
    return f"{height * 1e3:.1f} mm"
