"""A protocol's text with its gates at other heights, and all else as it stands there."""

import re

from rig.protocol.protocol import SIDES, Protocol
from rig.protocol.reader import parse
from rig.protocol.yamltree import load, place_of
from rig.reasons import rig_error

_VALUE = re.compile(r"\"[^\"]*\"|'[^']*'|[^,}\]\n#]*[^,}\]\n#\s]")
_ROUNDED = 0.05e-3 + 1e-9  # heights are written to 0.1 mm


def rewrite_heights(protocol: Protocol) -> str:
    """Write a protocol's text with its gates where they are now, to 0.1 mm.

    Parameters
    ----------
    protocol
        As it was read, but for the heights of its gates.

    Raises
    ------
    InputError
        Where the text does not say heights one by one.
    """
    root, lines = load(protocol.text, protocol.source), protocol.text.splitlines(keepends=True)
    changes: list[tuple[int, int, float]] = []
    for side in SIDES:
        for n, gate in enumerate(protocol.gates.on(side)):
            place = place_of(root, "gates", side, n, "height")
            changes.append((place.line - 1, place.column - 1, gate.height))
    for line, column, height in sorted(changes, reverse=True):  # from behind: places stay true
        text = lines[line]
        if value := _VALUE.match(text, column):
            lines[line] = f"{text[:column]}{height * 1e3:.1f} mm{text[value.end() :]}"
    text = "".join(lines)
    written = parse(text, protocol.source).gates
    if any(
        abs(gate.height - meant.height) > _ROUNDED
        for gate, meant in zip(written.gates, protocol.gates.gates, strict=True)
    ):
        raise rig_error("heights_unwritten", protocol=protocol.source)
    return text
