"""What is measured, one row a quantity: JSON, CSV, tables, figures and screens read it from here.

A new measurand is a row of ``measurands.txt`` and the function that computes it in
`rig.analysis.quantities`.
"""

import re
from collections.abc import Container, Iterator
from functools import partial
from typing import NamedTuple

from rig.text_rows import read_rows

_UNIT = re.compile(r"(_(m|kg|s|A|K|mol|cd|rad|sr|Hz|N|Pa|J|W|C|V|F|Ohm|S|Wb|T|H|lm|lx)[1-9]?)+$")
"""The SI unit at a name's end: base units and those with names of their own (SI brochure, 2.3)."""


class Measurand(NamedTuple):
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
    kinds
        In words: ``averaged`` where it has a mean over the runs of an incline, which is compared
        with the model; ``listed`` where it stands in the list of runs and among a drop's numbers
        on the screen; ``told`` where the one line on a drop names it; ``by_chain`` and ``by_side``
        where the difference that the striking chain makes is a result, and that of the sides.
    """

    name: str
    symbol: str
    label: str
    title: str
    meaning: str
    kinds: str
    unit: str
    scale: float
    decimals: int
    fine: str
    fine_scale: float
    fine_decimals: int

    @property
    def stem(self) -> str:
        """The name without its unit."""
        return _UNIT.sub("", self.name)

    def key(self, what: str) -> str:
        """Name something of it: ``sd`` of ``speed_m_s`` is ``speed_sd_m_s``."""
        return _UNIT.sub(rf"_{what}\g<0>", self.name)

    @property
    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.title} {self.symbol} ({self.unit})"


def _scale(cell: str) -> tuple[str, float, int]:
    unit, scale, decimals = cell.split()
    return unit, float(scale), int(decimals)


MEASURANDS = {
    name: Measurand(name, symbol, label, title, meaning, kinds, *_scale(usual), *_scale(fine))
    for name, symbol, label, title, meaning, kinds, usual, fine in read_rows(__file__)
}

SEPARATION = MEASURANDS["separation_m"]
SPEED = MEASURANDS["speed_m_s"]
RELEASE_SKEW = MEASURANDS["release_skew_s"]
FALL_TIME = MEASURANDS["fall_time_s"]
GRAVITY = MEASURANDS["gravity_m_s2"]
ACCELERATION = MEASURANDS["acceleration_m_s2"]


def of_kind(kind: str, among: Container[str] = MEASURANDS) -> Iterator[Measurand]:
    """Yield those of a kind, see `Measurand.kinds`, whose names are among some."""
    rows = MEASURANDS.values()
    return (row for row in rows if kind in row.kinds and row.name in among)


averaged, told = partial(of_kind, "averaged"), partial(of_kind, "told")


def acceleration_in(names: Container[str]) -> Measurand | None:
    """Return what measures how something falls that strikes nothing, where that is among names."""
    return next((row for row in (GRAVITY, ACCELERATION) if row.name in names), None)
