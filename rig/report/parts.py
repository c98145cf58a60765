"""Sections of a report beside the summary, for the page and the terminal alike."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rig.measurands import averaged, told
from rig.report.bars import LABELS, bar
from rig.report.columns import Column, incline
from rig.report.numbers import fixed, nested, plus_minus, value_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rig.measurands import Measurand

    Record = Mapping[str, Any]

_SCATTER_HEADINGS = {"incline": "incline (°)", "strikes": "strikes", "n": "n", "quantity": ""}
_SCATTER_HEADINGS |= {
    "mean": "mean",
    "SD": "SD",
    "SE": "SE",
    "u": "u",
    "U95": "U95",
    "half-SD": "SD/2",
}
_SCATTER = tuple(
    Column(heading, itemgetter(key), numeric=key not in {"quantity", "strikes"})
    for key, heading in _SCATTER_HEADINGS.items()
)


@dataclass(frozen=True, slots=True)
class Part:
    """A heading, sentences, and perhaps a table.

    Attributes
    ----------
    folded
        What a long table is called while it is folded away; empty shows it.
    """

    heading: str
    sentences: Sequence[str] = ()
    columns: Sequence[Column] = ()
    records: Sequence[Mapping[str, Any]] = ()
    folded: str = ""


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
            tuple(_effect_columns()),
            effects,
        )


def _number(name: str) -> Callable[[Record], str]:
    return lambda record: fixed(value_of(record.get(name)), 0)


def _effect_columns() -> Iterator[Column]:
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


def scatter_part(found: Mapping[str, Any]) -> Part:
    """Make the table.

    Parameters
    ----------
    found
        What ``rig analyze --json`` prints.
    """
    return Part(
        "Scatter of the runs",
        [
            "SD is the standard deviation of one run, SE that of the mean by scatter alone; u is "
            "the standard uncertainty of the mean with what all runs have in common, U95 the "
            "expanded one. SD/2 are the bars of Pantaleone's figures."
        ],
        _SCATTER,
        [*_scatters(found.get("summary") or ())],
    )


def _scatters(summary: Any) -> Iterator[Record]:
    for line in summary:
        for row in averaged():
            if row.name not in line:
                continue
            values: dict[str, float | None] = {"mean": value_of(line[row.name])}
            values |= {kind: bar(line, row.name, kind) for kind in LABELS}
            yield {
                "incline": incline(line),
                "strikes": str(line.get("impact_chain", "")),
                "n": fixed(line["n"], 0),
                "quantity": f"{row.symbol} ({row.fine})",
                **{
                    key: "" if value is None else fixed(value * row.fine_scale, row.fine_decimals)
                    for key, value in values.items()
                },
            }
