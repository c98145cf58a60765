"""The C face of the wire: what `rig.link.messages` defines, as the firmware's ``wire.h``.

``python -m rig.link.cheader > firmware/core/wire.h`` writes it anew.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rig.link import frames
from rig.link import messages as wire
from rig.link.messages import Chars, Field, Raw, Tail, UnsignedInt

if TYPE_CHECKING:
    from enum import IntEnum


_TOP = """\
/* Written by rig/link/cheader.py from rig/link/messages.py: change that file, not this one.
 *
 * MSG_X is a message's code, X_F where its field F begins in the payload (as long as nothing of
 * variable length stands before it), X_SIZE the payload's size without such fields. */
#ifndef WIRE_H
#define WIRE_H
"""


def header() -> str:
    """Write the header.

    Returns
    -------
    str
        C text: limits, reasons, codes, field offsets.
    """
    lines = [
        _TOP,
        _define("PROTOCOL_VERSION", wire.PROTOCOL_VERSION),
        _define("FRAME_LIMIT", frames.FRAME_LIMIT),
        _define("HOST_SILENCE_MS", wire.HOST_SILENCE_MS),
    ]
    for values in (wire.Phase, wire.RefusalReason, wire.DisarmReason, wire.PulseEnd):
        lines += ["", *_enum(values)]
    for code, message in wire.TABLE.items():
        lines += ["", *_message(code, message.__name__, wire.FIELDS[message])]
    return "\n".join([*lines, "", "#endif", ""])


def _enum(values: type[IntEnum]) -> list[str]:
    prefix = _upper(values.__name__).removeprefix("REFUSAL_")  # the board gives no other reasons
    return [_define(f"{prefix}_{value.name}", value) for value in values]


def _message(code: int, name: str, fields: tuple[Field, ...]) -> list[str]:
    prefix = _upper(name.removesuffix("Frame"))
    lines = [f"#define MSG_{prefix} 0x{code:02X}"]
    offset, fixed = 0, True
    for field in fields:
        if fixed:
            lines.append(_define(f"{prefix}_{_upper(field.name)}", offset))
        match field.wire:
            case UnsignedInt(size=size) | Raw(size=size):
                offset += size
            case Chars(limit=limit):
                lines.append(_define(f"{prefix}_{_upper(field.name)}_LIMIT", limit))
                fixed = False
            case Tail(size=size):
                lines.append(_define(f"{prefix}_RECORD", size))
                fixed = False
    return [*lines, _define(f"{prefix}_SIZE", offset)]


def _define(name: str, value: int) -> str:
    return f"#define {name} {int(value)}"


def _upper(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).upper()


if __name__ == "__main__":
    print(header(), end="")
