"""The USB numbers of boards that can run the firmware: the one list, also of the udev rule."""

from __future__ import annotations

from dataclasses import dataclass

from rig.boards import MEGA, UNO


@dataclass(frozen=True, slots=True)
class Known:
    """A kind of USB device.

    Attributes
    ----------
    vid, pid
        USB vendor and product.
    name
        What it is.
    board
        Whether the numbers belong to a board. A chip that is on cheap copies of boards is on
        other instruments too, so it says only that there may be one.
    """

    vid: int
    pid: int
    name: str
    board: bool


_MEGA, _UNO = MEGA.name, UNO.name

# Boards: as in boards.txt of the makers' own Arduino AVR package, 1.8. Chips: their makers'.
KNOWN = (
    Known(0x2341, 0x0010, _MEGA, board=True),
    Known(0x2341, 0x0042, _MEGA, board=True),
    Known(0x2341, 0x0210, _MEGA, board=True),
    Known(0x2341, 0x0242, _MEGA, board=True),
    Known(0x2A03, 0x0010, _MEGA, board=True),
    Known(0x2A03, 0x0042, _MEGA, board=True),
    Known(0x2341, 0x0001, _UNO, board=True),
    Known(0x2341, 0x0043, _UNO, board=True),
    Known(0x2341, 0x0243, _UNO, board=True),
    Known(0x2A03, 0x0043, _UNO, board=True),
    Known(0x1A86, 0x5523, "CH341", board=False),
    Known(0x1A86, 0x7523, "CH340", board=False),
    Known(0x0403, 0x6001, "FTDI FT232R", board=False),
    Known(0x0403, 0x6015, "FTDI FT231X", board=False),
)


def known(vid: int, pid: int) -> Known | None:
    """Find a kind of device, or `None`."""
    return next((kind for kind in KNOWN if (kind.vid, kind.pid) == (vid, pid)), None)
