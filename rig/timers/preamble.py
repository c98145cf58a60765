"""What stands above the rows of a table: headings, rows of units, and settings.

A setting is a name with its value behind ``:`` or ``=``, in the next cell or below it; a row may
also list inputs: names of columns that have none.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from rig.timers.vocabulary import (
    POWERS,
    find_label,
    form,
    is_number,
    normal,
    roles_in,
    unit_of,
    words,
)

TimeBase = tuple[float, float]
"""When the first sample was taken, and the time between two, s."""
_COLUMN_ROLES = {"time", "state", "edge", "volts", "gate", "run", "duration", "index", "derived"}
_PREFIXES = {"k": 3, "m": 6, "g": 9}


class Row(NamedTuple):
    """A line: its number, from 1, what its cells say, and how it was written."""

    line: int
    texts: list[str]
    raw: str = ""
    separator: str = ","

    def cell(self, at: int) -> str:
        """Return what a column, from 0, has; nothing where the row ends before it."""
        text = self.texts[at] if at < len(self.texts) else ""
        # Most are numbers.
        is_missing = not text[:1].isdigit() and text[:5].casefold() in words()["missing"]
        return "" if is_missing else text

    @property
    def known(self) -> int:
        """How many cells say what a column is."""
        texts = [text for text in self.texts if text and not is_number(text)]
        return sum(bool(_COLUMN_ROLES & roles_in(text) or unit_of(text)) for text in texts)

    @property
    def has_units(self) -> bool:
        """Whether it has units only, perhaps behind their name: ``Y_Unit_Label``."""
        texts = [normal(text.strip("()[] ")) for text in self.texts if text.strip("-")]
        units = {unit for role, unit in words().items() if role.startswith("unit")}
        return bool(texts) and all(
            any(text in unit for unit in units) or (not n and "unit" in text)
            for n, text in enumerate(texts)
        )

    def place(self, at: int) -> tuple[int, int]:
        """Return the line, and the column, from 1, at which a cell begins; 1 without the cell."""
        if at >= len(self.texts):
            return self.line, 1
        if not self.separator:
            return self.line, max(0, self.raw.find(self.texts[at])) + 1
        before = sum(len(cell) + 1 for cell in self.raw.split(self.separator)[:at])
        rest = self.raw[before:]
        return self.line, before + len(rest) - len(rest.lstrip(' "')) + 1


@dataclass(eq=False, slots=True)
class RowBlock:
    """Rows that stand together.

    Attributes
    ----------
    headings, above
        What stands above them, and above those of the block before.
    width
        How many cells the first one has.
    remarks
        Of the whole file, as far as read.
    """

    headings: list[Row] = field(default_factory=list)
    above: list[Row] = field(default_factory=list)
    width: int = 0
    remarks: list[Row] = field(default_factory=list)

    def find_heading(self, filled: Collection[int], width: int) -> Row | None:
        """Return the row with most cells that are known; above and below may stand symbols, units.

        A row with a measured number, or with more names than there are columns, is a setting.
        """
        rows = [
            row
            for row in self.headings
            if row.known
            and (len(row.texts) > 1 or len(filled) == 1)
            and any(row.cell(n) and not is_number(row.cell(n)) for n in filled)
            and all("setting" in roles_in(text) for text in filter(None, row.texts[width:]))
            and not any(is_number(text) and not text.isdecimal() for text in row.texts[:width])
        ]
        return max(rows, key=lambda row: (row.known, len("".join(row.texts))), default=None)

    def find_time_base(self) -> TimeBase | None:
        """Return the first sample's time and the step, s, that settings state; `None` without."""
        stated: dict[str, float] = {}
        for name, places in self._settings():
            role = next((role for role in ("rate", "start", "step") if role in roles_in(name)), "")
            for match in map(form("quantity").fullmatch, places) if role else ():
                if match:
                    power = _PREFIXES.get((match[2] or "").lower(), 0)
                    power -= POWERS.get(unit_of((match[3] or "").lower()), 0)
                    stated.setdefault(role, float(match[1].replace(",", ".")) * 10.0**power)
        step = stated.get("step") or (1.0 / stated["rate"] if stated.get("rate") else 0.0)
        return (stated.get("start", 0.0), step) if step else None

    def _settings(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Yield the name of each setting, and where its value may stand."""
        for above, below in itertools.pairwise([*self.remarks, *self.headings, Row(0, [])]):
            for n, text in enumerate(above.texts):
                name, _, inside = form("assignment").sub("\0", text[:60]).partition("\0")
                yield name, (inside.strip(), above.cell(n + 1), below.cell(n))

    def find_inputs(self, places: Sequence[int]) -> list[str]:
        """Return names for columns without a heading.

        A row lists as many inputs, each equally far to the left of its column.
        """
        for row in [*self.remarks, *self.headings]:
            labels = [find_label(text.rpartition(":")[2], "gate") for text in row.texts]
            named = [n for n, label in enumerate(labels) if label]
            distances = {at - n for at, n in zip(places, named, strict=False)}
            if len(named) == len(places) and len(distances) == 1 and min(distances) >= 0:
                return [labels[n] for n in named]
        return []
