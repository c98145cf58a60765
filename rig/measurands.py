"""What is measured, one row a quantity: JSON, CSV, tables, figures and screens read it from here.

A new measurand is a row of ``measurands.txt`` and the function that computes it in
`rig.analysis.quantities`.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from rig.text_rows import read_rows

_UNIT = re.compile(r"(_(m|kg|s|A|K|mol|cd|rad|sr|Hz|N|Pa|J|W|C|V|F|Ohm|S|Wb|T|H|lm|lx)[1-9]?)+$")
"""The SI unit at a name's end: base units and those with names of their own (SI brochure, 2.3)."""


@dataclass(frozen=True, slots=True)
class Measurand:
    """One quantity.

    Attributes
    ----------
    name
        In JSON and CSV: what it is and its SI unit, ``separation_m``.
    symbol, label, title
        In headings, in a list of one drop's numbers, and in front of the symbol on an axis.
    meaning
        For who reads the CSV files.
    unit, scale, decimals
        For people: ``value · scale`` has that unit, and so many decimals where no uncertainty says.
    fine, fine_scale, fine_decimals
        The same for differences and scatter.
    averaged
        Whether it has a mean over the runs of an incline, which is compared with the model.
    listed
        Whether it stands in the list of runs and among a drop's numbers on the screen.
    told
        Whether the one line on a drop names it.
    by_chain, by_side
        Whether the difference that the striking chain makes is a result, and that of the sides.
    """

    name: str
    symbol: str
    label: str
    title: str
    meaning: str
    unit: str
    scale: float
    decimals: int
    fine: str
    fine_scale: float
    fine_decimals: int
    averaged: bool = False
    listed: bool = False
    told: bool = False
    by_chain: bool = False
    by_side: bool = False

    @property
    def stem(self) -> str:
        """The name without its unit."""
        return _UNIT.sub("", self.name)

    def key(self, what: str) -> str:
        """Name something of it: ``sd`` of ``speed_m_s`` is ``speed_sd_m_s``."""
        return f"{self.stem}_{what}{self.name.removeprefix(self.stem)}"

    @property
    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.title} {self.symbol} ({self.unit})"


def _measurand(cells: Iterable[str]) -> Measurand:
    name, symbol, label, title, usual, fine, flags, meaning = cells
    (unit, scale, decimals), (fine_unit, fine_scale, fine_decimals) = usual.split(), fine.split()
    options: dict[str, Any] = dict.fromkeys(flags.split(), True)
    return Measurand(
        *(name, symbol, label, title, meaning, unit, float(scale), int(decimals)),
        *(fine_unit, float(fine_scale), int(fine_decimals)),
        **options,
    )


MEASURANDS = {row.name: row for row in map(_measurand, read_rows(__file__))}

SEPARATION = MEASURANDS["separation_m"]
SPEED = MEASURANDS["speed_m_s"]
RELEASE_SKEW = MEASURANDS["release_skew_s"]
FALL_TIME = MEASURANDS["fall_time_s"]
GRAVITY = MEASURANDS["gravity_m_s2"]
ACCELERATION = MEASURANDS["acceleration_m_s2"]


def acceleration_in(names: Container[str]) -> Measurand | None:
    """Return what measures how something falls that strikes nothing, where that is among names."""
    return next((row for row in (GRAVITY, ACCELERATION) if row.name in names), None)


def averaged() -> Iterator[Measurand]:
    """Yield those that have a mean over the runs of an incline."""
    return (row for row in MEASURANDS.values() if row.averaged)


def told() -> Iterator[Measurand]:
    """Yield those that one line on a drop names."""
    return (row for row in MEASURANDS.values() if row.told)
