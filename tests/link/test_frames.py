import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rig.link.frames import (
    FRAME_LIMIT,
    PAYLOAD_LIMIT,
    Decoder,
    Frame,
    FrameError,
    cobs_decode,
    decode,
    encode,
)
from tests.examples import examples

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
        with pytest.raises(FrameError):
            cobs_decode(data)
    else:
        assert cobs_decode(data) == plain


@given(FRAMES)
@example(Frame(255, 255, 255, b"\xff" * PAYLOAD_LIMIT))
def test_frame_round_trip(frame):
    data = encode(frame)
    assert len(data) <= FRAME_LIMIT
    assert data.index(0) == len(data) - 1
    assert len(data) == len(frame.payload) + 7  # type, seq, ack, CRC; COBS adds a byte, and the end
    assert decode(data[:-1]) == frame


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
def test_anything_is_survived_in_bounded_memory(chunks, frame):
    decoder = Decoder()
    for chunk in chunks:
        decoder.feed(chunk)
        assert len(decoder._partial) <= FRAME_LIMIT
    assert decoder.feed(b"\0" + encode(frame))[-1] == frame


@given(FRAMES, st.data())
def test_a_damaged_byte_is_noticed(frame, data):
    sent = bytearray(encode(frame))
    at = data.draw(st.integers(0, len(sent) - 2))
    sent[at] ^= data.draw(st.integers(1, 255))
    decoder = Decoder()
    # A damaged COBS code moves zeros about; the CRC finds that with 1 - 2**-16.
    assert frame not in decoder.feed(bytes(sent))


def test_an_overlong_stretch_counts_once():
    decoder = Decoder()
    for _ in range(10):
        decoder.feed(b"x" * 100)
    frame = Frame(1, 2, 3, b"abc")
    assert decoder.feed(b"x\0" + encode(frame)) == [frame]
    assert decoder.bad == 1


def test_idle_delimiters_are_no_fault():
    decoder = Decoder()
    assert decoder.feed(bytes(1000)) == []
    assert decoder.bad == 0


@pytest.mark.parametrize(
    "frame", [Frame(1, 1, 0, bytes(PAYLOAD_LIMIT + 1)), Frame(256, 0, 0, b""), Frame(1, -1, 0, b"")]
)
def test_what_does_not_fit_is_refused(frame):
    with pytest.raises(ValueError, match=r"at most|range"):
        encode(frame)
