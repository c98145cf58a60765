"""The firmware's header has the values of `rig.link.messages`, and the places of `pack`."""

import re
from pathlib import Path

from rig.link import frames
from rig.link import messages as wire
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
    expected = limits | enums | codes
    assert {name: C[name] for name in expected} == expected
    places = {
        f"{name_in_c(kind)}_{place}"
        for kind, fields in wire.FIELDS.items()
        for place in (
            *("SIZE", "RECORD"),
            *(f"{one.name.upper()}{end}" for one in fields for end in ("", "_LIMIT")),
        )
    }
    assert set(C) <= set(expected) | places
