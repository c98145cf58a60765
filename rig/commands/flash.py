"""``rig flash``."""

from __future__ import annotations

from argparse import Namespace

from rig.commands.output import goes_on, say
from rig.errors import InputError
from rig.flash.boards import DRIVE, TARGETS, UNSEEN
from rig.flash.steps import flash, flash_drive
from rig.reasons import make_error


@goes_on("the firmware may be incomplete; run the same command again")
def main(arguments: Namespace) -> int:
    """Flash a board and say what it is now."""
    board, port = arguments.board, arguments.port
    if TARGETS[board] is DRIVE:
        if arguments.avrdude is not None:
            raise make_error(InputError, "avrdude_for_pico", board=DRIVE.board.name)
        identity = flash_drive(arguments.drive, port, arguments.hex, say)
    elif arguments.drive is not None:
        raise make_error(InputError, "drive_of_arduino", board=DRIVE.board.name)
    elif port is None:
        raise make_error(InputError, "flash_without_port")
    else:
        identity = flash(board, port, arguments.hex, arguments.avrdude, say)
    print(
        f"{identity.board}, {identity.firmware}, {identity.gates} gates, "
        f"id {identity.unique_id.hex()}: flashed and verified"
    )
    say(f"this firmware was {UNSEEN}")
    return 0
