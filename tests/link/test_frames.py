"""Frames, messages and a drop put together of them: all that is said comes out again."""

from dataclasses import fields

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rig import boards
from rig.link import messages as wire
from rig.link.frames import (
    FRAME_LIMIT,
    PAYLOAD_LIMIT,
    Decoder,
    Frame,
    FrameError,
    cobs_decode,
    encode,
)
from rig.link.refusals import DeviceRefusedError
from sim.line import BadLine
from tests.examples import examples
from tests.link.strategies import MESSAGES
from tests.refusals import refused
from tests.tables import cases

FRAMES = st.builds(
    Frame,
    st.integers(0, 255),
    st.integers(0, 255),
    st.integers(0, 255),
    st.binary(max_size=PAYLOAD_LIMIT),
)


def unstuffed(data: bytes) -> bytes | None:
    """COBS as its authors tell it: a code says where the next zero was."""
    if not 0 < len(data) < FRAME_LIMIT or 0 in data:
        return None
    out = bytearray()
    at = 0
    while at < len(data):
        code = data[at]
        if at + code > len(data):
            return None
        out += data[at + 1 : at + code]
        at += code
        if code != 0xFF and at < len(data):
            out.append(0)
    return bytes(out)


@examples(300)
@given(
    st.binary(max_size=40)
    | st.lists(st.integers(1, 5) | st.integers(250, 255), max_size=260).map(bytes)
)
@example(b"\1" * FRAME_LIMIT)
def test_cobs_is_what_its_authors_tell(data):
    plain = unstuffed(data)
    if plain is None:
        refused(FrameError, "", cobs_decode, data)
    else:
        assert cobs_decode(data) == plain


@given(st.lists(FRAMES, max_size=8), st.data())
def test_any_cut_gives_the_same_frames(frames, data):
    stream = b"".join(map(encode, frames))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=20)))
    decoder = Decoder()
    got = []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        got += decoder.feed(stream[start:end])
    assert got == frames
    assert (decoder.good, decoder.bad) == (len(frames), 0)


@given(st.lists(st.binary(max_size=700), max_size=12), FRAMES)
@example([], Frame(255, 255, 255, b"\xff" * PAYLOAD_LIMIT))
def test_anything_is_survived_in_bounded_memory(chunks, frame):
    decoder = Decoder()
    for chunk in chunks:
        decoder.feed(chunk)
        assert len(decoder._partial) <= FRAME_LIMIT
    assert decoder.feed(b"\0" + encode(frame))[-1] == frame


def test_an_overlong_stretch_counts_once():
    decoder = Decoder()
    for _ in range(10):
        decoder.feed(b"x" * 100)
    frame = Frame(1, 2, 3, b"abc")
    assert decoder.feed(b"x" + bytes(1000) + encode(frame)) == [frame], "idle is no fault"
    assert decoder.bad == 1


@pytest.mark.parametrize(
    "frame", [Frame(1, 1, 0, bytes(PAYLOAD_LIMIT + 1)), Frame(256, 0, 0, b""), Frame(1, -1, 0, b"")]
)
def test_a_frame_that_does_not_fit_is_refused(frame):
    refused(ValueError, r"at most|range", encode, frame)


@given(st.integers(0, 255), st.binary(max_size=PAYLOAD_LIMIT))
def test_any_payload_is_a_message_or_an_error(code, payload):
    try:
        message = wire.unpack(code, payload)
    except wire.MessageError:
        return
    assert wire.pack(message) == (code, payload)


@given(MESSAGES, st.data())
def test_a_cut_payload_is_never_another_size(message, data):
    code, payload = wire.pack(message)
    for wrong in (payload[: data.draw(st.integers(0, len(payload)))], payload + b"\1"):
        if wrong != payload and not isinstance(message, wire.EventsFrame):
            refused(wire.MessageError, "", wire.unpack, code, wrong)


def test_a_bad_line_alters_bytes_or_loses_them():
    altered, left = (
        BadLine(*faults, busy=0.0, seed=3).transfer(bytes(1000), b"")[0]
        for faults in ((0.2, 0.0), (0.0, 0.2))
    )
    assert (len(altered), left) == (1000, bytes(len(left)))
    assert 100 < 1000 - altered.count(0) < 300
    assert 700 < len(left) < 900


def test_every_message_is_in_the_table_once():
    assert len(wire.CODES) == len(wire.TABLE) == 23, "a code is never given twice"
    for code, kind in wire.TABLE.items():
        assert issubclass(kind, wire.HostMessage if code < 0x80 else wire.DeviceMessage)
        assert [f.name for f in wire.FIELDS[kind]] == [f.name for f in fields(kind)]
        assert not any(getattr(f.wire, "tail", False) for f in wire.FIELDS[kind][:-1])


@cases
def test_what_does_not_fit_is_refused(kind, values):
    values = [value.encode() if "\0" in str(value) else value for value in values]
    refused(wire.MessageError, "", wire.pack, getattr(wire, kind)(*values))


@given(st.integers(0, 0xFFFF), st.integers(1, 0xFFFF))
def test_labels(run, attempt):
    assert wire.unpack_label(wire.pack_label(run, attempt)) == (run, attempt)


@pytest.mark.parametrize("pair", [(-1, 1), (65536, 1), (1, 0), (1, 65536)])
def test_impossible_labels(pair):
    refused(ValueError, "65535", wire.pack_label, *pair)


@pytest.mark.parametrize("reason", wire.RefusalReason)
def test_every_refusal_has_advice(reason):
    error = DeviceRefusedError(reason, 0x0005)
    assert error.hint
    assert "{" not in error.message


def test_the_wire_has_room_for_what_the_table_of_boards_allows():
    width = {field.name: 8 * field.wire.size for field in wire.FIELDS[wire.Arm]}
    assert width["gates"] == boards.GATES
    assert width["release"] == boards.RELEASES
    assert 2 ** width["record_ms"] - 1 == boards.LONGEST_RECORD_MS
