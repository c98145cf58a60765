"""``rig flash``."""

from rig.commands.output import Arguments, goes_on, say
from rig.flash.boards import DRIVE, TARGETS, UNSEEN
from rig.flash.steps import flash
from rig.reasons import rig_error
from rig.report.templates import sentence


@goes_on("the firmware may be incomplete; run the same command again")
def main(arguments: Arguments) -> None:
    """Flash a board and say what it is now."""
    board, avrdude, drive = arguments.board, arguments.avrdude, arguments.drive
    if TARGETS[board] is DRIVE and avrdude is not None:
        raise rig_error("avrdude_for_pico", board=DRIVE.board.name)
    if TARGETS[board] is not DRIVE and drive is not None:
        raise rig_error("drive_of_arduino", board=DRIVE.board.name)
    identity = flash(board, arguments.port, arguments.hex, avrdude or drive, say)
    print(sentence("flashed", identity.json()))
    say(f"this firmware was {UNSEEN}")
