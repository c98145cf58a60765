"""The firmware's header has the values of `rig.link.messages`, and the places of `pack`."""

import re
from collections.abc import Iterator
from pathlib import Path

from rig.link import frames
from rig.link import messages as wire
from rig.link.messages import Chars, Raw, UnsignedInt
from tests.link.strategies import name_in_c

HEADER = Path(__file__).parents[2] / "firmware/core/wire.h"


def defines(text: str) -> dict[str, int]:
    found = re.findall(r"^#define (\w+) (\S+)$", text, re.MULTILINE)
    names = [name for name, _ in found]
    assert len(set(names)) == len(names)
    return {name: int(value, 0) for name, value in found}


C = defines(HEADER.read_text("utf-8"))


def test_every_name_is_there_with_its_value():
    limits = {
        "PROTOCOL_VERSION": wire.PROTOCOL_VERSION,
        "FRAME_LIMIT": frames.FRAME_LIMIT,
        "HOST_SILENCE_MS": wire.HOST_SILENCE_MS,
    }
    enums = {
        f"{prefix}_{value.name}": value
        for prefix, kind in (
            ("PHASE", wire.Phase),
            ("REASON", wire.RefusalReason),
            ("DISARM_REASON", wire.DisarmReason),
            ("PULSE_END", wire.PulseEnd),
        )
        for value in kind
    }
    codes = {f"MSG_{name_in_c(kind)}": code for code, kind in wire.TABLE.items()}
    places = {name: at for kind in wire.FIELDS for name, at in places_of(kind)}
    assert limits | enums | codes | places == C


def places_of(kind: type) -> Iterator[tuple[str, int]]:
    """Tell where each field begins, up to the first of varying size, and what varies."""
    name, at, fixed = name_in_c(kind), 0, True
    for field in wire.FIELDS[kind]:
        key = f"{name}_{field.name.upper()}"
        if fixed:
            yield key, at
        match field.wire:
            case Chars(limit=limit):
                yield f"{key}_LIMIT", limit
                fixed = False
            case Raw(size=size, tail=True):
                yield f"{name}_RECORD", size
                fixed = False
            case UnsignedInt(size=size) | Raw(size=size):
                at += size
    yield f"{name}_SIZE", at
