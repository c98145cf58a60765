"""Results of a sweep as a CSV table and as NumPy arrays, each with where it comes from."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from rig import __version__
from rig.sweep.compute import NOTES, Swept
from rig.sweep.variables import VARIABLES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rig.protocol.protocol import Protocol
    from rig.sweep.layout import Layout

_ROWS = 20_000  # made into text together; a whole sweep's would not fit


def provenance(protocol: Protocol, layout: Layout) -> dict[str, Any]:
    """Return what it takes to make a sweep again, as JSON has it; SI, angles in degrees."""
    facts: dict[str, Any] = {
        "made_by": f"rig {__version__} sweep",
        "protocol": protocol.source,
        "protocol_sha256": hashlib.sha256(protocol.text.encode()).hexdigest(),
        "title": protocol.title,
        "chain": {
            "name": next(iter(protocol.chains)),
            "rods": layout.chain.rods,
            "length_m": layout.chain.length,
        },
        "fixed": {VARIABLES[name].column: value for name, value in layout.fixed.items()},
        "axes": {
            VARIABLES[axis.name].column: f"{axis.values[0]} to {axis.values[-1]}, "
            f"{len(axis.values)} values"
            for axis in layout.grid.axes
        },
        "notes": {str(bit): meaning for bit, meaning in NOTES.items()},
    }
    if layout.longer_m:
        facts["free_chain_longer_m"] = layout.longer_m
    if layout.pile is not None:
        below, beta = layout.pile.below_deg, layout.pile.restitution.value
        facts["pile"] = {"below_deg": below, "restitution": beta}
    return facts


def write_csv(stream: BinaryIO, facts: Mapping[str, Any], layout: Layout, swept: Swept) -> None:
    """Write one row a point, the last axis running fastest, behind comments of provenance.

    An empty value means that the model has no answer there.
    """
    head = [f"# {name}: {json.dumps(fact, ensure_ascii=False)}" for name, fact in facts.items()]
    columns = [VARIABLES[axis.name].column for axis in layout.grid.axes]
    columns += ["separation_m", "speed_m_s", "in_domain", "notes"]
    stream.write("\n".join([*head, ",".join(columns), ""]).encode())
    for rows in layout.grid.chunks(_ROWS):
        lines = zip(*_text(layout, swept, rows), strict=True)
        stream.write(("\n".join(map(",".join, lines)) + "\n").encode())


def _text(layout: Layout, swept: Swept, rows: slice) -> Iterator[list[str]]:
    """Each column of some rows; numbers have the digits that give the same float back."""
    for axis, places in layout.grid.places(rows):
        values = list(map(repr, axis.values))
        yield [values[number] for number in places.tolist()]
    for column in (swept.separation_m, swept.speed_m_s):
        # The only number that is not equal to itself is NaN.
        yield [repr(x) if x == x else "" for x in column.reshape(-1)[rows].tolist()]  # noqa: PLR0124
    yield ["1" if inside else "0" for inside in swept.in_domain.reshape(-1)[rows].tolist()]
    yield list(map(str, swept.notes.reshape(-1)[rows].tolist()))


def write_npz(
    stream: BinaryIO, facts: Mapping[str, Any], text: str, layout: Layout, swept: Swept
) -> None:
    """Write arrays that `numpy.load` reads.

    Each axis is there under its column's name, ``axes`` has these names in the order of the
    dimensions of ``separation_m``, ``speed_m_s``, ``in_domain`` and ``notes``; ``metadata`` is the
    provenance as JSON and ``protocol`` the protocol's text.
    """
    names = [VARIABLES[axis.name].column for axis in layout.grid.axes]
    arrays: dict[str, Any] = {
        name: np.array(axis.values) for name, axis in zip(names, layout.grid.axes, strict=True)
    }
    np.savez(
        stream,
        axes=np.array(names),
        separation_m=swept.separation_m,
        speed_m_s=swept.speed_m_s,
        in_domain=swept.in_domain,
        notes=swept.notes,
        metadata=np.array(json.dumps(facts, ensure_ascii=False)),
        protocol=np.array(text),
        **arrays,
    )
