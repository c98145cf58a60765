"""Frames: COBS( type | seq | ack | payload | CRC-16 ) 0x00.

COBS (Cheshire & Baker, IEEE/ACM Trans. Networking 7, 1999) removes every zero from a frame, so a
zero always means "a frame ends here" and a receiver is in step again after one lost frame. The
check is CRC-16/CCITT-FALSE over everything before it, little-endian like all numbers here.
"""

from binascii import crc_hqx
from typing import NamedTuple

FRAME_LIMIT = 255
"""Bytes of a whole frame with its delimiter: an 8-bit length suffices in firmware."""
PAYLOAD_LIMIT = FRAME_LIMIT - 7
"""Without type, seq, ack, CRC (2), the COBS code byte and the delimiter."""
DELIMITER = b"\0"


class FrameError(ValueError):
    """Bytes that are not a frame, or a frame that would not fit."""


class Frame(NamedTuple):
    """One frame.

    Attributes
    ----------
    type
        Message code.
    seq
        The sender's own counter, 1 … 255 and around again; 0 is "none".
    ack
        `seq` of the request this frame answers; 0 when it answers none.
    payload
        At most `PAYLOAD_LIMIT` bytes.
    """

    type: int
    seq: int
    ack: int
    payload: bytes


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF, not reflected).

    Parameters
    ----------
    data
        Any bytes.

    Returns
    -------
    int
        The check, 0 … 0xFFFF; 0x29B1 for ``b"123456789"``.
    """
    return crc_hqx(data, 0xFFFF)


def cobs_encode(body: bytes) -> bytes:
    """Stuff the body of a frame so that no zero is left.

    Parameters
    ----------
    body
        At most 253 bytes: COBS begins another block behind 254 without a zero, and no frame is
        as long as that.

    Returns
    -------
    bytes
        Zero-free, without delimiter; longer by 1.
    """
    return b"".join([bytes((len(block) + 1,)) + block for block in body.split(DELIMITER)])


def cobs_decode(stuffed: bytes) -> bytes:
    """Undo `cobs_encode`.

    Parameters
    ----------
    stuffed
        A frame without its delimiter.

    Returns
    -------
    bytes
        Its body.

    Raises
    ------
    FrameError
        When the bytes contain a zero, are empty, too many, or end within a block.
    """
    if not 0 < len(stuffed) < FRAME_LIMIT or 0 in stuffed:
        raise FrameError("not COBS: empty, longer than a frame can be, or with a zero inside")
    # In place: every code byte but the first stands where a zero was. This loop is most of what
    # reading a frame takes.
    body = bytearray(stuffed)
    at, end = stuffed[0], len(stuffed)
    while at < end:
        body[at] = 0
        at += stuffed[at]
    if at > end:
        raise FrameError("not COBS: the last block is cut short")
    return bytes(body[1:])


def encode(frame: Frame) -> bytes:
    """Write a frame as it goes over the line, delimiter included.

    Parameters
    ----------
    frame
        The frame.

    Returns
    -------
    bytes
        At most `FRAME_LIMIT` bytes, with one zero, at the end.

    Raises
    ------
    ValueError
        When the payload is too long or a header field is not a byte.
    """
    if len(frame.payload) > PAYLOAD_LIMIT:
        raise FrameError(f"payload of {len(frame.payload)} bytes, at most {PAYLOAD_LIMIT} fit")
    body = bytes(frame[:3]) + frame.payload
    return cobs_encode(body + crc16(body).to_bytes(2, "little")) + DELIMITER


def decode(stuffed: bytes) -> Frame:
    """Read one frame.

    Parameters
    ----------
    stuffed
        The bytes between two delimiters.

    Returns
    -------
    Frame
        The frame.

    Raises
    ------
    FrameError
        When COBS, length or CRC is wrong.
    """
    body = cobs_decode(stuffed)
    if len(body) < 5 or crc16(body[:-2]) != int.from_bytes(body[-2:], "little"):
        raise FrameError("too short, or wrong CRC")
    return Frame(body[0], body[1], body[2], body[3:-2])


class Decoder:
    """Finds frames in a stream of bytes; survives anything, in bounded memory.

    Attributes
    ----------
    good, bad
        How many frames were read, and how many stretches between delimiters were not a frame.
    """

    good = bad = 0
    _partial = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream.

        Parameters
        ----------
        data
            Any number of bytes, cut anywhere.

        Returns
        -------
        list of Frame
            The frames that ended within these bytes.
        """
        *complete, partial = (self._partial + data).split(DELIMITER)
        frames: list[Frame] = []
        for stuffed in filter(None, complete):  # nothing between two delimiters is idle line
            try:
                frames.append(decode(stuffed))
            except FrameError:
                self.bad += 1
        self.good += len(frames)
        self._partial = partial[:FRAME_LIMIT]  # as much as tells that the stretch is too long
        return frames
