"""Flashing a board, from the file to the handshake."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing

from rig.errors import DeviceError, DeviceTimeoutError, InputError
from rig.flash import drive as drives
from rig.flash.avrdude import find_avrdude, write_flash
from rig.flash.boards import DRIVE, TARGETS, Target
from rig.flash.image import read_image
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.messages import Identity, RefusalReason
from rig.link.port import Port, open_port, port_clock
from rig.link.refusals import DeviceRefusedError
from rig.reasons import make_error

_UDEV_S = 2.0
"""For which a port that has just appeared may be forbidden: udev gives permission after it."""


def flash(
    board: str, port: str, image: str | None, avrdude: str | None, say: Callable[[str], None]
) -> Identity:
    """Flash a board and verify it.

    Parameters
    ----------
    board
        A key of `TARGETS`.
    port
        Device path.
    image
        Intel HEX file; `None`: the one that comes with this program.
    avrdude
        Path of avrdude; `None`: wherever programs are.
    say
        Told what happens.

    Returns
    -------
    Identity
        What the board answered.

    Raises
    ------
    InputError
        No real port, no such program, or a file that must not be flashed.
    DeviceError
        The port cannot be used, flashing failed, or the board does not say what it should.
    """
    if "://" in port:
        raise make_error(InputError, "not_flashable", port=port)
    target = TARGETS[board]
    program = find_avrdude(avrdude)
    file = read_image(image, target)
    # Avrdude tries for ever to open a port that is not there, and does not ask who uses it.
    with closing(open_port(port)):
        pass
    say(f"writing {file.firmware} ({file.size} bytes) to the {target.board.name} at {port}")
    write_flash(program, target, port, file.path)
    say("written; asking the board who it is")
    return identify(port, target, file.firmware)


def flash_drive(
    drive: str | None, port: str | None, image: str | None, say: Callable[[str], None]
) -> Identity:
    """Copy the firmware to a Pico that waits for it, and verify it.

    Parameters
    ----------
    drive
        Folder at which its drive is mounted; `None`: wherever it is.
    port
        Device path that it will have; `None`: whichever appears.
    image
        UF2 file; `None`: the one that comes with this program.
    say
        Told what happens.

    Returns
    -------
    Identity
        What the board answered.

    Raises
    ------
    InputError
        No such drive, or a file that must not be flashed.
    DeviceError
        No Pico waits, writing failed, or the board does not say what it should.
    """
    file = read_image(image, DRIVE)
    if drive is None and not drives.waiting_drives() and not drives.sees_boot_pico():
        _ask_to_wait(port, say)
    folder = drives.choose_drive(drive)
    before = drives.pico_ports()
    say(f"copying {file.firmware} ({file.size} bytes) to the {DRIVE.board.name} at {folder}")
    drives.copy_to(folder, file.path)
    say("copied; asking the board who it is")
    return identify(port or drives.new_port(before), DRIVE, file.firmware)


def _ask_to_wait(port: str | None, say: Callable[[str], None]) -> None:
    """Ask the one Pico that runs to take firmware, which it does when it has nothing else to do."""
    ports = {port} if port else drives.pico_ports()
    if len(ports) != 1:
        return
    (path,) = ports
    with closing(open_port(path)) as opened:
        device = Device(opened, port_clock(opened))
        try:
            device.connect()
            device.request(wire.Flash(), wire.Done)
        except DeviceTimeoutError:
            return  # by its button
        except DeviceRefusedError as refusal:
            if refusal.reason in {RefusalReason.UNKNOWN_MESSAGE, RefusalReason.VERSION}:
                return  # it has older firmware
            raise
    say(f"the {DRIVE.board.name} at {path} waits for firmware")
    any(drives.waiting_drives() for _ in drives.looks(drives.MOUNT_S))


def identify(port: str, target: Target, firmware: str) -> Identity:
    """Ask a freshly flashed board who it is.

    Parameters
    ----------
    port
        Device path.
    target
        The board it must be.
    firmware
        The firmware's name and version it must say.

    Raises
    ------
    DeviceError
        It does not answer, or with other names.
    """
    with closing(_open_soon(port)) as opened:
        try:
            identity = Device(opened, port_clock(opened)).connect()
        except DeviceTimeoutError as error:
            raise make_error(DeviceTimeoutError, "flashed_silent", port=port) from error
    if (identity.board, identity.firmware) != (target.board.name, firmware):
        names = {"board": target.board.one, "answer": f"{identity.board}, {identity.firmware}"}
        raise make_error(DeviceError, "flashed_other", port=port, firmware=firmware, **names)
    return identity


def _open_soon(port: str) -> Port:
    """Open a port as soon as it is permitted."""
    for _ in drives.looks(_UDEV_S):
        try:
            return open_port(port)
        except DeviceError as error:
            if all(reason.code != "port_denied" for reason in error.reasons):
                raise
    return open_port(port)
