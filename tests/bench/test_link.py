"""The benchmark of the link measures what it says; how fast that is belongs to ./run bench."""

from bench import decoding
from rig.link.messages import EVENTS_PER_FRAME
from rig.link.transcript import Incoming, Transcript


def test_the_stream_is_what_a_board_sends():
    transcript = Transcript()
    found = transcript.feed("rx", 0, b"".join(decoding.frames(3)))
    assert all(isinstance(one, Incoming) for one in found)
    assert [one.message.first for one in found] == [0, EVENTS_PER_FRAME, 2 * EVENTS_PER_FRAME]
    assert transcript.unreadable == 0


def test_all_decoders_find_the_same_edges():
    data = b"".join(decoding.frames(4))
    edges = decoding.to_edges(data)
    wanted = [(n * decoding.TICKS, 0, n % 2 == 0) for n in range(4 * EVENTS_PER_FRAME)]
    assert edges == wanted == decoding.bytewise(data)
    assert decoding.bytewise(data[:-2] + b"?" + data[-1:]) == wanted[:-EVENTS_PER_FRAME]
    assert decoding.speed(decoding.checked, 4) > 0.0
