"""A drop is put together, whatever is lost of it, as it would be event by event."""

from __future__ import annotations

import zlib

from hypothesis import given
from hypothesis import strategies as st

from rig.link import messages as wire
from rig.link.assembly import Assembly
from rig.link.messages import Event, pack_events
from tests.examples import examples
from tests.link.strategies import LONG

STATES = st.integers(0, 2**16 - 1) | st.integers(0, 3)
EVENT_LISTS = st.lists(st.builds(Event, LONG, STATES), max_size=12)


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
        latest = data.draw(st.integers(1, 20))
        drop.forget_events(latest)
        known = dict(sorted(known.items())[:-latest])
    assert drop.missing() == []
    total, fire_tick = data.draw(st.integers(0, 40)), data.draw(LONG)
    crc = zlib.crc32(pack_events([e for number, e in sorted(known.items()) if number < total]))
    crc ^= data.draw(st.integers(0, 1))
    gates, initial = data.draw(STATES), data.draw(STATES)
    drop.certificate = wire.DropCertificate(
        drop.label, fire_tick, gates, initial, total, crc, 0, 0, 0, 0, 0
    )
    first = data.draw(st.integers(0, 10))
    assert drop.missing(first) == [n for n in range(first, total) if n not in known]
    whole = set(range(total)) <= set(known)
    right = crc == zlib.crc32(pack_events([known[n] for n in range(total)])) if whole else False
    assert drop.sound() == right
    made = drop.drop(16_000_000)
    assert made.edges == edges_one_by_one(known, drop.certificate, fire_tick)
    assert bool(made.faults) != drop.sound()
