"""Effects of chains and sides, for the page and the terminal alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.report.columns import Column, incline
from rig.report.numbers import fixed, nested, plus_minus, value_of
from rig.report.parts import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    Record = Mapping[str, Any]


def effects_parts(found: Mapping[str, Any]) -> Iterator[Part]:
    """Yield the section on effects where an analysis has any.

    Parameters
    ----------
    found
        What ``rig analyze --json`` prints.
    """
    effects = found.get("effects") or ()
    if effects:
        first, second = effects[0]["chains"]
        yield Part(
            f"Chain {first} less chain {second}, and sides",
            [
                f"Paired differences over blocks of {first}, {second}, {second}, {first}: the "
                f"quantity when {first} strikes less that when {second} does. What stays of the "
                "release skew when the chains change places goes with the sides: positive where "
                "the free side lets go later."
            ],
            _COLUMNS,
            effects,
        )


def _quantity(scale: float, *path: str) -> Callable[[Record], str]:
    return lambda record: plus_minus(nested(record, *path), scale)


def _number(name: str) -> Callable[[Record], str]:
    return lambda record: fixed(value_of(record.get(name)), 0)


_COLUMNS = (
    Column("incline (°)", incline),
    Column("blocks", _number("blocks")),
    Column("Δz ± U (mm)", _quantity(1000.0, "chain", "separation_m")),
    Column("V ± U (mm/s)", _quantity(1000.0, "chain", "speed_m_s")),
    Column("skew ± U (ms)", _quantity(1000.0, "chain", "release_skew_s")),
    Column("sides' skew ± U (ms)", _quantity(1000.0, "side", "release_skew_s")),
)
