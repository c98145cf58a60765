"""Results of a sweep as a CSV table and as NumPy arrays, each with where it comes from."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from rig import __version__
from rig.protocol.protocol import Protocol
from rig.sweep.compute import NOTES, Swept
from rig.sweep.layout import Layout
from rig.sweep.variables import VARIABLES

_ROWS = 20_000  # made into text together; a whole sweep's would not fit
_RESULTS = ("separation_m", "speed_m_s", "in_domain", "notes")


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
        "fixed": {VARIABLES[name].column: value for name, value in layout.fixed_values.items()},
        "axes": {
            VARIABLES[name].column: f"{values[0]} to {values[-1]}, {len(values)} values"
            for name, values in layout.axes.items()
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
    columns = [*(VARIABLES[name].column for name in layout.axes), *_RESULTS]
    stream.write("\n".join([*head, ",".join(columns), ""]).encode())
    for rows in layout.chunks(_ROWS):
        # Flags as 1 and 0.
        results = (1 * getattr(swept, name).reshape(-1)[rows] for name in _RESULTS)
        lines = zip(*map(_text, [*layout.along_axes(rows).values(), *results]), strict=True)
        stream.write(("\n".join(map(",".join, lines)) + "\n").encode())


def _text(column: NDArray[Any]) -> list[str]:
    """Write numbers with the digits that give the same float back."""
    # The only number that is not equal to itself is NaN.
    return [repr(x) if x == x else "" for x in column.tolist()]  # noqa: PLR0124


def write_npz(
    stream: BinaryIO, facts: Mapping[str, Any], text: str, layout: Layout, swept: Swept
) -> None:
    """Write arrays that `numpy.load` reads.

    Each axis is there under its column's name, ``axes`` has these names in the order of the
    dimensions of ``separation_m``, ``speed_m_s``, ``in_domain`` and ``notes``; ``metadata`` is the
    provenance as JSON and ``protocol`` the protocol's text.
    """
    arrays: dict[str, Any] = {
        VARIABLES[name].column: np.array(values) for name, values in layout.axes.items()
    }
    arrays["axes"] = np.array(list(arrays))
    arrays |= {name: getattr(swept, name) for name in _RESULTS}
    metadata = np.array(json.dumps(facts, ensure_ascii=False))
    np.savez(stream, metadata=metadata, protocol=np.array(text), **arrays)
