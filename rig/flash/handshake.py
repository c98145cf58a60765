"""The proof that flashing worked: the board itself says what it is."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING

from rig.errors import DeviceError, DeviceTimeoutError
from rig.link.client import Device
from rig.link.port import open_port, port_clock

if TYPE_CHECKING:
    from rig.flash.boards import Target
    from rig.link.messages import Identity


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
    with closing(open_port(port)) as opened:
        try:
            identity = Device(opened, port_clock(opened)).connect()
        except DeviceTimeoutError as error:
            raise DeviceTimeoutError(
                f"{port} was flashed, but the firmware does not answer",
                "pull the board's plug, put it in again, then rig selftest",
            ) from error
    if (identity.board, identity.firmware) != (target.board.name, firmware):
        raise DeviceError(
            f"{port} was flashed with {firmware} for an {target.board.name}, but answers as "
            f"{identity.board}, {identity.firmware}",
            "is this the port of the board that was flashed? rig ports",
        )
    return identity
