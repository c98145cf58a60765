"""COBS, decoded in place, is what its authors tell."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.link.frames import FrameError, cobs_decode
from tests.examples import examples


def unstuffed(data: bytes) -> bytes | None:
    """COBS as its authors tell it: a code says where the next zero was."""
    if not data or 0 in data:
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
    | st.lists(st.integers(1, 5) | st.integers(250, 255), max_size=20).map(bytes)
    | st.lists(st.sampled_from([b"\xff" + b"x" * 254, b"\x03ab", b"\1"]), max_size=6).map(b"".join)
)
def test_cobs_is_what_its_authors_tell(data):
    plain = unstuffed(data)
    if plain is None:
        with pytest.raises(FrameError):
            cobs_decode(data)
    else:
        assert cobs_decode(data) == plain
