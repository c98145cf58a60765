"""COBS, decoded in place, is what its authors tell."""

from __future__ import annotations

import struct
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.link import messages as wire
from rig.link.assembly import Assembly
from rig.link.frames import FRAME_LIMIT, PAYLOAD_LIMIT, FrameError, cobs_decode
from rig.link.messages import Event, pack_events
from tests.examples import examples
from tests.link.strategies import LONG, MESSAGES

STATES = st.integers(0, 2**16 - 1) | st.integers(0, 3)
EVENT_LISTS = st.lists(st.builds(Event, LONG, STATES), max_size=12)


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
def test_cobs_is_what_its_authors_tell(data):
    plain = unstuffed(data)
    if plain is None:
        with pytest.raises(FrameError):
            cobs_decode(data)
    else:
        assert cobs_decode(data) == plain


def field_by_field(code: int, payload: bytes) -> list | None:
    values, at = [], 0
    try:
        for field in wire.FIELDS[wire.TABLE[code]]:
            value, at = field.wire.unpack(payload, at)
            values.append(field.python(value))
    except (struct.error, ValueError, LookupError):
        return None
    return values if at == len(payload) else None


@examples(300)
@given(
    MESSAGES.map(wire.pack)
    | st.tuples(st.sampled_from(list(wire.TABLE)), st.binary(max_size=PAYLOAD_LIMIT))
    | st.tuples(st.integers(0, 255), st.binary(max_size=8)),
    st.integers(-3, 1),
)
def test_a_message_is_its_fields_one_by_one(packed, cut):
    code, payload = packed
    payload = payload[:cut] if cut < 0 else payload + bytes(cut)
    values = field_by_field(code, payload)
    if values is None:
        with pytest.raises(wire.MessageError):
            wire.unpack(code, payload)
        return
    message = wire.unpack(code, payload)
    fields = wire.FIELDS[type(message)]
    assert [getattr(message, field.name) for field in fields] == values


def edges_one_by_one(known, certificate, fire_tick):
    """Edges from a dictionary of events by number."""
    found, state, expected = [], certificate.initial_state & certificate.gates, 0
    for number, event in sorted(known.items()):
        if number >= certificate.events:
            continue
        now = event.state & certificate.gates
        since = (event.tick - fire_tick + 2**31) % 2**32 - 2**31
        changed = state ^ now if number == expected else 0
        channels = [channel for channel in range(16) if changed >> channel & 1]
        found += [(since, channel, bool(now >> channel & 1)) for channel in channels]
        state, expected = now, number + 1
    return tuple(found)


def gaps_one_by_one(known, begin, total, at_most):
    found = []
    for number in range(begin, total):
        if number in known:
            continue
        if found and sum(found[-1]) == number and found[-1][1] < at_most:
            found[-1] = (found[-1][0], found[-1][1] + 1)
        else:
            found.append((number, 1))
    return found


@examples(200)
@given(st.data())
def test_a_drop_is_put_together_as_from_single_events(data):
    drop, known = Assembly(wire.pack_label(1, 1)), {}
    assert not drop.begun
    for _ in range(data.draw(st.integers(0, 5))):
        first, events = data.draw(st.integers(0, 30)), data.draw(EVENT_LISTS)
        drop.add(wire.EventsFrame(drop.label, first, pack_events(events)))
        known |= dict(enumerate(events, first))
    assert drop.begun == bool(known)
    if data.draw(st.booleans()):
        latest = data.draw(st.none() | st.integers(0, 20))
        drop.forget_events(latest)
        first = 0 if latest is None else max(0, len(known) - latest)
        known = {number: event for number, event in known.items() if number < first}
    assert drop.missing() == []
    total, fire_tick = data.draw(st.integers(0, 40)), data.draw(LONG)
    crc = zlib.crc32(pack_events([e for number, e in sorted(known.items()) if number < total]))
    crc ^= data.draw(st.integers(0, 1))
    gates, initial = data.draw(STATES), data.draw(STATES)
    drop.certificate = wire.DropCertificate(
        drop.label, fire_tick, gates, initial, total, crc, 0, 0, 0, 0, 0
    )
    drop.first_kept = data.draw(st.integers(0, 10))
    at_most = data.draw(st.integers(1, 50))
    assert drop.missing(at_most) == gaps_one_by_one(known, 0, total, at_most)
    kept = gaps_one_by_one(known, drop.first_kept, total, at_most)
    assert drop.missing(at_most, readable=True) == kept
    whole = set(range(total)) <= set(known)
    right = crc == zlib.crc32(pack_events([known[n] for n in range(total)])) if whole else False
    assert drop.sound() == right
    made = drop.drop(16_000_000)
    assert made.edges == edges_one_by_one(known, drop.certificate, fire_tick)
    assert bool(made.faults) != drop.sound()
