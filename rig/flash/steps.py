"""Flashing a board, from the file to the handshake."""

from contextlib import closing

from rig.flash.avrdude import write_flash
from rig.flash.boards import TARGETS, Say
from rig.flash.drive import copy_firmware
from rig.flash.image import read_image
from rig.link.client import Device
from rig.link.messages import Identity
from rig.link.port import open_port, port_clock
from rig.reasons import rig_error


def flash(board: str, port: str | None, image: str | None, way: str | None, say: Say) -> Identity:
    """Flash a board and verify it.

    Parameters
    ----------
    board
        A key of `TARGETS`.
    port
        Device path; `None`, for a board with a drive: whichever appears.
    image
        The firmware's file; `None`: the one that comes with this program.
    way
        Path of avrdude, or the folder of the board's drive; `None`: wherever it is.
    say
        Told what happens.

    Returns
    -------
    Identity
        What the board answered.

    Raises
    ------
    InputError
        No real port, no such program or drive, or a file that must not be flashed.
    DeviceError
        The port cannot be used, flashing failed, or the board does not say what it should.
    """
    target = TARGETS[board]
    file = read_image(image, target)
    if not target.avrdude:
        port = copy_firmware(port, way, file, say)
    elif port is None:
        raise rig_error("flash_without_port")
    else:
        write_flash(target, port, way, file, say)
    say("written; asking the board who it is")
    with closing(open_port(port)) as opened:
        identity = Device(opened, port_clock(opened)).connect()
    if (identity.board, identity.firmware) != (target.board.name, file.firmware):
        names = {"board": target.board.one, "answer": f"{identity.board}, {identity.firmware}"}
        raise rig_error("flashed_other", port=port, firmware=file.firmware, **names)
    return identity
