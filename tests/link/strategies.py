"""Any message of the wire's table, for hypothesis."""

import re

from hypothesis import strategies as st

from rig.link import messages as wire

WORD, LONG = st.integers(0, 2**16 - 1), st.integers(0, 2**32 - 1)


def name_in_c(kind: type) -> str:
    """Name a message as the firmware and its page do."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind.__name__.removesuffix("Frame")).upper()


def values(field) -> st.SearchStrategy:
    match field.wire:
        case wire.UnsignedInt() if field.python is not int:
            return st.sampled_from(list(field.python))
        case wire.UnsignedInt(size=size):
            return st.integers(0, 2 ** (8 * size) - 1)
        case wire.Raw(size=size, tail=False):
            return st.binary(min_size=size, max_size=size)
        case wire.Chars(limit=limit):
            return st.text(max_size=limit // 4)
        case wire.Raw():
            events = st.lists(st.tuples(LONG, WORD), max_size=wire.EVENTS_PER_FRAME)
            return events.map(wire.pack_events)
    raise AssertionError(field)


def messages_of(kind) -> st.SearchStrategy:
    return st.builds(kind, **{f.name: values(f) for f in wire.FIELDS[kind]})


MESSAGES = st.one_of([messages_of(kind) for kind in wire.TABLE.values()])
