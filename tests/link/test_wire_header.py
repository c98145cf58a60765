"""The firmware's header has the values of `rig.link.messages`, and the places of `pack`."""

import re
from pathlib import Path

from hypothesis import given

from rig.link import frames
from rig.link import messages as wire
from rig.link.messages import Chars, Raw, UnsignedInt
from tests.link.strategies import MESSAGES, name_in_c

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


@given(MESSAGES)
def test_fields_are_where_the_header_says(message):
    code, payload = wire.pack(message)
    name = name_in_c(type(message))
    assert C[f"MSG_{name}"] == code
    fixed, varying = True, 0
    for field in wire.FIELDS[type(message)]:
        value, key = getattr(message, field.name), f"{name}_{field.name.upper()}"
        assert (key in C) == fixed
        at = C.get(key, 0)
        match field.wire:
            case UnsignedInt(size=size) if fixed:
                assert int.from_bytes(payload[at : at + size], "little") == value
            case Raw(size=size, tail=False) if fixed:
                assert payload[at : at + size] == value
            case Chars(limit=limit):
                assert C[f"{key}_LIMIT"] == limit
                text = value.encode()
                if fixed:
                    assert payload[at : at + 1 + len(text)] == bytes([len(text)]) + text
                fixed, varying = False, varying + 1 + len(text)
            case Raw(tail=True):
                assert payload[at:] == value
                assert len(value) % C[f"{name}_RECORD"] == 0
                fixed, varying = False, varying + len(value)
    assert len(payload) == C[f"{name}_SIZE"] + varying
