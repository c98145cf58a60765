"""The ``priors`` of a protocol: assumptions about what nobody measured."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from rig.protocol import fields
from rig.protocol.fields import Range, Section
from rig.protocol.protocol import Priors
from rig.units import Dimension


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
        "unmodelled scatter of an edge",
        "rods made to ISO 2768-1 f: ±0.15 mm, uniform, is 0.09 mm",
    ),
    "jitter": Prior(
        Range(Dimension.TIME, 0.0, 0.1, "µs"),
        "scatter of one time stamp",
        "an edge that waits for another interrupt of a 16 MHz AVR: some µs",
    ),
    "hang": Prior(
        _LENGTH,
        "scatter of the start height from run to run",
        "hung by hand against a mark: ±0.5 mm, uniform, is 0.29 mm (GUM 4.3.7)",
    ),
    "side": Prior(
        _LENGTH,
        "height difference of the two sides, the same in every run",
        "two marks, each read to 1 mm: √2 · 0.29 mm, rounded up",
    ),
    "beam_offset": Prior(
        _LENGTH,
        "distance of a beam from the rods' middle; matters where rods are tilted",
        "a beam of 3 mm aimed by eye: ±1.7 mm, uniform",
    ),
    "off_centre": Prior(
        _LENGTH,
        "the same from run to run: where a chain hangs along its beams",
        "hung by hand: ±1.7 mm, uniform",
    ),
    "swing": Prior(
        Range(Dimension.SPEED, 0.0, 1.0, "m/s"),
        "speed of the lowest rod as the chain is released",
        "a chain of 1 m that visibly swings by 3 cm",
    ),
    "departure": Prior(
        _LENGTH,
        "distance of a rod from its place in the chain after impacts",
        "resolved falls: 0.2 mm with dead, 0.4 mm with lively strings",
    ),
    "last_rods": Prior(
        _LENGTH,
        "the same for the last rods: added, divided by their number",
        "resolved falls: 0.2 mm with damped, 2.4 mm with lively strings",
    ),
    "impulses": Prior(
        Range(Dimension.NUMBER, 0.0, 1.0, "%"),
        "scatter of single impulses, relative to α",
        "resolved falls: 18 to 22 %, whatever the strings",
    ),
    "impulse_floor": Prior(
        Range(Dimension.NUMBER, 0.0, 0.5, "1"),
        "smallest scatter of single impulses, as α",
        "a guess: about 1 % of α on a level surface",
    ),
    "last_impulse": Prior(
        Range(Dimension.NUMBER, 0.0, 10.0, "%"),
        "further scatter of the last impulse, relative to α",
        "a guess; up to 200 % in resolved falls with lively strings",
    ),
    "strings": Prior(
        Range(Dimension.NUMBER, 0.0, 10.0, "%"),
        "pull of strings in the last impulse of every run, relative to α",
        "a guess: a damped string has a restitution of 30 %",
    ),
    "stretch": Prior(
        Range(Dimension.NUMBER, 0.0, 1.0, "%"),
        "pull of strings on the top rod, relative to α times the chain's length",
        "resolved falls: 4 mm of 1165 mm at α 0.15",
    ),
    "late_pull": Prior(
        Range(Dimension.NUMBER, 0.0, 10.0, "%"),
        "share of the last impulse that comes below the lowest beam",
        "a guess, from resolved falls",
    ),
    "drag": Prior(
        Range(Dimension.NUMBER, 0.0, 10.0, "1"),
        "κ of the air, 1/m, where no drag is stated: 0 ± this",
        "½ρCd/(¼π ρ_rod d²) of 12.7 mm rods: 0.025 aluminium, 0.06 acrylic, 0.09 oak",
    ),
}


@fields.of_keys(*PRIORS)
def read_priors(section: Section) -> Priors | None:
    """Convert to what is known beforehand; what is left out is as it is by default."""
    found = {
        name: section.take(name, fields.exact(row.accepted))
        for name, row in PRIORS.items()
        if name in section
    }
    known = {name: value for name, value in found.items() if value is not None}
    return replace(Priors(), **known) if len(known) == len(found) else None
