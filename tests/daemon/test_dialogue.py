"""What comes from a daemon is the same messages however it was cut."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.daemon import rpc
from rig.daemon.client import MessageReader
from rig.errors import DeviceError

MESSAGES = st.lists(st.dictionaries(st.text(max_size=4), st.text(max_size=9), max_size=3))


@given(MESSAGES, st.data())
def test_any_cut_gives_the_same_messages(messages, data):
    stream = b"".join(json.dumps(one).encode() + b"\n" for one in messages)
    cuts = data.draw(st.lists(st.integers(1, max(1, len(stream))), max_size=9, unique=True))
    ends = sorted({*cuts, len(stream)} - {0})
    dialogue, found = MessageReader(), []
    for begin, end in zip([0, *ends], ends, strict=False):
        if part := stream[begin:end]:
            found += dialogue.feed(part)
    assert found == messages
    with pytest.raises(DeviceError, match="hung up"):
        list(dialogue.feed(b""))


@pytest.mark.parametrize("line", [b"HTTP/1.1 400 Bad Request\n", b"\xff\xfe\n", b"[1]\n", b"\n"])
def test_who_is_no_daemon_is_told_so(line):
    with pytest.raises(DeviceError, match="not a daemon of this rig"):
        list(MessageReader().feed(line))


def test_a_line_without_an_end_is_no_daemons():
    dialogue = MessageReader()
    assert list(dialogue.feed(b"x" * rpc.MESSAGE_LIMIT)) == []
    with pytest.raises(DeviceError, match="not a daemon of this rig"):
        list(dialogue.feed(b"x"))
