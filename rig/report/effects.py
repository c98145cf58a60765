"""Effects of chains and sides, for the page and the terminal alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.measurands import told
from rig.report.columns import Column, incline
from rig.report.numbers import fixed, nested, plus_minus, value_of
from rig.report.parts import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from rig.measurands import Measurand

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
            tuple(_columns()),
            effects,
        )


def _number(name: str) -> Callable[[Record], str]:
    return lambda record: fixed(value_of(record.get(name)), 0)


def _columns() -> Iterator[Column]:
    yield Column("incline (°)", incline)
    yield Column("blocks", _number("blocks"))
    for row in told():
        if row.by_chain:
            yield _effect("chain", row.symbol, row)
    for row in told():
        if row.by_side:
            yield _effect("side", f"sides' {row.symbol}", row)


def _effect(of: str, what: str, row: Measurand) -> Column:
    def cell(record: Record) -> str:
        return plus_minus(nested(record, of, row.name), row.fine_scale)

    return Column(f"{what} ± U ({row.fine})", cell)
