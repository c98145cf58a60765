"""``rig flash``."""

from __future__ import annotations

from argparse import Namespace

from rig.commands.output import goes_on, say
from rig.errors import InputError
from rig.flash.boards import DRIVE, TARGETS
from rig.flash.steps import flash, flash_drive


def main(arguments: Namespace) -> int:
    """Flash a board and say what it is now."""
    with goes_on("the firmware may be incomplete; run the same command again"):
        return _flash(arguments)


def _flash(arguments: Namespace) -> int:
    board, port = arguments.board, arguments.port
    if board not in TARGETS:
        if arguments.avrdude is not None:
            raise InputError(f"--avrdude does not write a {DRIVE.board.name}", "leave it out")
        identity = flash_drive(arguments.drive, port, arguments.hex, say)
    elif arguments.drive is not None:
        raise InputError(f"--drive is for a {DRIVE.board.name}", "an Arduino has a --port")
    elif port is None:
        raise InputError(
            "rig flash: --port is missing", "such as --port /dev/ttyACM0; rig ports lists the ports"
        )
    else:
        identity = flash(board, port, arguments.hex, arguments.avrdude, say)
    print(
        f"{identity.board}, {identity.firmware}, {identity.gates} gates, "
        f"id {identity.unique_id.hex()}: flashed and verified"
    )
    return 0
