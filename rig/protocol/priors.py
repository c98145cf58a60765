"""The ``priors`` of a protocol: what is taken to be known where nobody measured it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from rig.protocol import fields
from rig.protocol.fields import Range, Section
from rig.protocol.protocol import Priors
from rig.units import Dimension

if TYPE_CHECKING:
    from rig.protocol.fields import FieldFaults
    from rig.protocol.yamltree import Node


class Prior(NamedTuple):
    """One key; its default is that of `rig.protocol.protocol.Priors`.

    Attributes
    ----------
    accepted
        What it may be.
    words
        What it says.
    source
        Where the default comes from.
    """

    accepted: Range
    words: str
    source: str


_LENGTH = Range(Dimension.LENGTH, 0.0, 0.1, "mm")


PRIORS: dict[str, Prior] = {
    "edge_floor": Prior(
        _LENGTH,
        "what an edge may be off for reasons not in the equations",
        "rods made to ISO 2768-1 f, 30 to 120 mm: ±0.15 mm, evenly likely, is 0.09 mm",
    ),
    "jitter": Prior(
        Range(Dimension.TIME, 0.0, 0.1, "µs"),
        "scatter of one time stamp",
        "an edge that waits for another one's interrupt on a 16 MHz AVR: some µs",
    ),
    "hang": Prior(
        _LENGTH,
        "scatter of a chain's hanging height from run to run",
        "hung by hand against a mark: ±0.5 mm evenly likely, 0.29 mm (GUM 4.3.7)",
    ),
    "side": Prior(
        _LENGTH,
        "how much lower one side hangs than the other, in every run",
        "two marks, each read to the nearest mm: √2 · 0.29 mm, rounded up (GUM 4.3.7)",
    ),
    "beam_offset": Prior(
        _LENGTH,
        "how far off a rod's middle a beam runs; times tan(tilt) it shifts edges rod by rod",
        "a beam of 3 mm aimed by eye: ±1.7 mm evenly likely (GUM 4.3.7)",
    ),
    "swing": Prior(
        Range(Dimension.SPEED, 0.0, 1.0, "m/s"),
        "how fast the bottom rod swings as a chain is let go",
        "a chain of a metre that swings 3 cm to and fro, which one sees",
    ),
    "departure": Prior(
        _LENGTH,
        "how far off its chain a rod may be once rods have struck",
        "resolved falls: 0.2 mm with dead strings to 0.4 mm with lively ones",
    ),
    "last_rods": Prior(
        _LENGTH,
        "and besides where few rods still fall: times one over their number",
        "resolved falls: 0.2 mm with damped strings to 2.4 mm with lively ones",
    ),
    "impulses": Prior(
        Range(Dimension.NUMBER, 0.0, 1.0, "%"),
        "scatter of single impulses, relative to α",
        "resolved falls: 18 to 22 %, whatever the strings",
    ),
    "impulse_floor": Prior(
        Range(Dimension.NUMBER, 0.0, 0.5, "1"),
        "and at least, as α",
        "a guess: about 1 % of α at level ground",
    ),
    "last_impulse": Prior(
        Range(Dimension.NUMBER, 0.0, 10.0, "%"),
        "and of the last one besides, relative to α: one rod alone goes as its own string does",
        "a guess; resolved falls with lively strings have up to 200 %",
    ),
    "strings": Prior(
        Range(Dimension.NUMBER, 0.0, 10.0, "%"),
        "what strings may add to the last impulse in every run, relative to α",
        "a guess: 30 % is the restitution of a damped string",
    ),
    "drag": Prior(
        Range(Dimension.NUMBER, 0.0, 10.0, "1"),
        "κ of the air, 1/m, where no drag is stated: 0 ± this",
        "½ρCd/(¼π ρ_rod d²) of 12.7 mm rods: 0.025 of aluminium, 0.06 of acrylic, 0.09 of oak",
    ),
}


def read_priors(node: Node, key: str, faults: FieldFaults) -> Priors | None:
    """Convert to what is known beforehand; what is left out is as it is by default."""
    inner = fields.mapping(node, key, faults)
    if inner is None:
        return None
    section = Section(inner, key, faults, tuple(PRIORS))
    found = {
        name: section.take(name, fields.exact(row.accepted))
        for name, row in PRIORS.items()
        if name in section
    }
    known = {name: value for name, value in found.items() if value is not None}
    return replace(Priors(), **known) if len(known) == len(found) else None
