from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig import boards
from rig.link import messages as wire
from rig.link.frames import PAYLOAD_LIMIT
from rig.link.refusals import DeviceRefusedError
from tests.link.strategies import MESSAGES


@given(MESSAGES)
def test_round_trip(message):
    code, payload = wire.pack(message)
    assert len(payload) <= PAYLOAD_LIMIT
    assert wire.unpack(code, payload) == message


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
            with pytest.raises(wire.MessageError):
                wire.unpack(code, wrong)


def test_every_message_is_in_the_table_once():
    assert len(wire.CODES) == len(wire.TABLE) == 23, "a code is never given twice"
    for code, kind in wire.TABLE.items():
        assert issubclass(kind, wire.HostMessage if code < 0x80 else wire.DeviceMessage)
        assert [f.name for f in wire.FIELDS[kind]] == [f.name for f in fields(kind)]
        assert not any(getattr(f.wire, "tail", False) for f in wire.FIELDS[kind][:-1])


@pytest.mark.parametrize(
    "message",
    [
        wire.Pong(2**32),
        wire.Pong(-1),
        wire.Read(1, 2, 256),
        wire.EventsFrame(1, 2, bytes(7)),
        wire.Identity(1, "b" * 25, "f", bytes(8), 1, 1, 1, 1, 1, 0, 1, ""),
        wire.Identity(1, "b", "f", bytes(7), 1, 1, 1, 1, 1, 0, 1, ""),
    ],
)
def test_what_does_not_fit_is_refused(message):
    with pytest.raises(wire.MessageError):
        wire.pack(message)


def test_values_without_a_name_are_refused():
    with pytest.raises(wire.MessageError, match="RefusalReason"):
        wire.unpack(0x86, b"\xff\0\0")
    with pytest.raises(wire.MessageError, match="0x42"):
        wire.unpack(0x42, b"")


@given(st.integers(0, 0xFFFF), st.integers(1, 0xFFFF))
def test_labels(run, attempt):
    label = wire.pack_label(run, attempt)
    assert 0 < label < 2**32
    assert wire.unpack_label(label) == (run, attempt)


@pytest.mark.parametrize("pair", [(-1, 1), (65536, 1), (1, 0), (1, 65536)])
def test_impossible_labels(pair):
    with pytest.raises(ValueError, match="65535"):
        wire.pack_label(*pair)


def test_a_flicker_of_some_gate_is_told_without_a_number():
    assert (
        DeviceRefusedError(wire.RefusalReason.GATE_UNSTEADY, 0).message
        == "a gate changed after arming"
    )


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
