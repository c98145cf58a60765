"""A protocol's text with its gates at other heights, and all else as it stands there."""

from __future__ import annotations

import re
from collections.abc import Sequence

from rig.design.cases import beams_of
from rig.errors import InputError
from rig.protocol.protocol import SIDES, Protocol, Side
from rig.protocol.reader import parse
from rig.protocol.yamltree import load, place_of

_VALUE = re.compile(r"\"[^\"]*\"|'[^']*'|[^,}\]\n#]*[^,}\]\n#\s]")
_ROUNDED = 0.05e-3 + 1e-9  # heights are written to 0.1 mm


def with_heights(protocol: Protocol, beams: Sequence[tuple[Side, float]]) -> str:
    """Write a protocol's text with its gates at other heights.

    Gates of a side keep their order: the lowest one goes to the lowest new height.

    Parameters
    ----------
    protocol
        As it was read.
    beams
        Side and height (m) of each gate, as many on each side as there are.

    Raises
    ------
    InputError
        Where the text does not say heights one by one.
    """
    assert protocol.gates is not None
    root, lines = load(protocol.text, protocol.source), protocol.text.splitlines(keepends=True)
    changes: list[tuple[int, int, float]] = []
    for side in SIDES:
        own = protocol.gates.on(side)
        order = sorted((gate.height, n) for n, gate in enumerate(own))
        heights = sorted(height for where, height in beams if where == side)
        for (_, n), height in zip(order, heights, strict=True):
            place = place_of(root, "gates", side, n, "height")
            changes.append((place.line - 1, place.column - 1, height))
    for line, column, height in sorted(changes, reverse=True):  # from behind: places stay true
        text = lines[line]
        value = _VALUE.match(text, column)
        if value is not None:
            lines[line] = f"{text[:column]}{height * 1e3:.1f} mm{text[value.end() :]}"
    text = "".join(lines)
    written = sorted(beams_of(parse(text, protocol.source)))
    if any(
        side != wanted_side or abs(height - meant) > _ROUNDED
        for (side, height), (wanted_side, meant) in zip(written, sorted(beams), strict=True)
    ):
        raise InputError(
            f"{protocol.source}: its heights are not written one by one", "change them by hand"
        )
    return text
