"""The wire as others read it: firmware/PROTOCOL.md and the C header say what the code does."""

import ast
import re
from pathlib import Path
from typing import NamedTuple

from rig.link import frames
from rig.link import messages as wire
from rig.link.frames import Frame, encode
from rig.link.port import BAUDRATE
from tests.link.strategies import name_in_c

FIRMWARE = Path(__file__).parents[2] / "firmware"
PAGE = (FIRMWARE / "PROTOCOL.md").read_text("utf-8")
TALK_TEXT = (FIRMWARE / "examples/conversation.txt").read_text("utf-8")


KINDS = {name_in_c(kind): kind for kind in wire.TABLE.values()}


def rows(text):
    """Cells of the first table in a text, without its head."""
    table = re.search(r"(?:^\|.*\n)+", text, re.MULTILINE)
    lines = table.group().splitlines()[2:] if table else []
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def section(heading):
    depth = heading.index(" ")
    start = PAGE.index(f"\n{heading}\n") + len(heading) + 2
    end = re.compile(rf"^#{{1,{depth}}} ", re.MULTILINE).search(PAGE, start)
    return PAGE[start : end.start() if end else len(PAGE)]


# -- tables


def test_every_message_has_its_table():
    headings = re.findall(r"^### (\w+) 0x([0-9A-F]{2})$", PAGE, re.MULTILINE)
    assert [(name, int(code, 16)) for name, code in headings] == [
        (name_in_c(kind), code) for code, kind in wire.TABLE.items()
    ]
    for code, kind in wire.TABLE.items():
        text = section(f"### {name_in_c(kind)} 0x{code:02X}")
        assert [row[:3] for row in rows(text)] == expected_rows(kind), kind
        assert all(row[3] for row in rows(text)[kind is wire.DropCertificate2 :]), kind


def expected_rows(kind):
    at: int | None = 0
    found = []
    for field in wire.FIELDS[kind]:
        size = None
        match field.wire:
            case wire.UnsignedInt(size=size):
                name = f"u{8 * size}"
            case wire.Raw(size=size, tail=False):
                name = f"{size} bytes"
            case wire.Chars(limit=limit):
                name = f"text ≤ {limit}"
            case wire.Raw(size=record):
                name = f"{record} bytes each"
        found.append(["" if at is None else str(at), field.name, name])
        at = None if at is None or size is None else at + size
    if kind is wire.DropCertificate2:
        inherited = len(wire.FIELDS[wire.DropCertificate])
        return [["0", "as DROP_CERTIFICATE", f"{found[inherited][0]} bytes"], *found[inherited:]]
    return found


def test_phases_and_reasons_have_their_numbers():
    phases = rows(section("## Phases"))
    assert [(int(row[0]), row[1]) for row in phases] == [(p, p.name) for p in wire.Phase]
    reasons = re.findall(r"^\| (\d+) \| ([A-Z_]+) \|", section("## Refusals"), re.MULTILINE)
    assert [(int(number), name) for number, name in reasons] == [
        (r, r.name) for r in wire.RefusalReason
    ]
    disarmed = rows(section(f"### DISARMED 0x{wire.CODES[wire.Disarmed]:02X}"))[1][3]
    assert disarmed == ", ".join(f"{int(r)} {r.name}" for r in wire.DisarmReason)


def test_limits_are_those_of_the_code():
    for said in (
        f"{BAUDRATE:,} baud",
        f"Version {wire.PROTOCOL_VERSION}:",
        f"0 to {frames.PAYLOAD_LIMIT} |",
        f"at most {frames.FRAME_LIMIT} bytes",
        f"longer than {frames.FRAME_LIMIT - 2} ",
        f"| {wire.HOST_SILENCE_MS} ms without a request |",
        f"0x{frames.crc16(b'123456789'):04X} for the ASCII text `123456789`",
    ):
        assert said in PAGE
    plain, stuffed = re.search(r"`([\d ]+)` becomes `([\d ]+)`", PAGE).groups()
    assert frames.cobs_encode(bytes.fromhex(plain)) == bytes.fromhex(stuffed)


def test_every_reason_is_in_the_order_of_some_request():
    orders = rows(section("## Refusals"))
    named = {reason for _, order in orders for reason in order.split(", ")}
    assert named == {r.name for r in wire.RefusalReason} - {"UNKNOWN_MESSAGE"}


# -- the conversation


class Said(NamedTuple):
    direction: str
    frame: Frame
    message: wire.Message
    data: bytes


def conversation():
    """Read what each frame of the example is said to be, and its bytes."""
    found = []
    for part in re.split(r"^(?=host|device)", TALK_TEXT, flags=re.MULTILINE)[1:]:
        head, *lines = part.splitlines()
        who, seq, ack = re.fullmatch(r"(\w+) +seq (\d+)(?: ack (\d+))?", head).groups()
        told = " ".join(line.strip() for line in lines if re.match(r" {4}\S", line))
        data = bytes.fromhex(" ".join(line for line in lines if re.match(r" {6}\S", line)))
        message = spoken(told)
        code, payload = wire.pack(message)
        frame = Frame(code, int(seq), int(ack or 0), payload)
        found.append(Said("tx" if who == "host" else "rx", frame, message, data))
    return found


def spoken(told):
    """Make the message that ``NAME(field=value, ...)`` tells of; every field must be told."""
    call = ast.parse(told, mode="eval").body
    kind = KINDS[call.func.id]
    fields = {field.name: field for field in wire.FIELDS[kind]}
    values = {}
    for keyword in call.keywords:
        field = fields[keyword.arg]
        if isinstance(keyword.value, ast.Name):
            value = field.python[keyword.value.id]
        else:
            value = ast.literal_eval(keyword.value)
            if isinstance(field.wire, wire.Raw):
                value = wire.pack_events(value) if field.wire.tail else bytes.fromhex(value)
        values[keyword.arg] = value
    return kind(**values)


TALK = conversation()


def test_every_message_and_both_sides_speak():
    # The certificate of version 1 is read, and not sent any more.
    assert {type(said.message) for said in TALK} == set(wire.TABLE.values()) - {
        wire.DropCertificate
    }
    for said in TALK:
        assert (said.direction == "tx") == (said.frame.type < 0x80)


def test_what_is_said_gives_the_bytes():
    for said in TALK:
        assert encode(said.frame) == said.data


HEADER = Path(__file__).parents[2] / "firmware/core/wire.h"


def defines(text):
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


def places_of(kind):
    """Tell where each field begins, up to the first of varying size, and what varies."""
    name, at, fixed = name_in_c(kind), 0, True
    for field in wire.FIELDS[kind]:
        key = f"{name}_{field.name.upper()}"
        if fixed:
            yield key, at
        match field.wire:
            case wire.Chars(limit=limit):
                yield f"{key}_LIMIT", limit
                fixed = False
            case wire.Raw(size=size, tail=True):
                yield f"{name}_RECORD", size
                fixed = False
            case wire.UnsignedInt(size=size) | wire.Raw(size=size):
                at += size
    yield f"{name}_SIZE", at
