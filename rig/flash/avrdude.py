"""Calling avrdude, showing what it says, and saying what went wrong."""

import os
from contextlib import suppress
from subprocess import DEVNULL, PIPE, STDOUT, Popen, TimeoutExpired

from rig.flash.boards import Say, Target
from rig.flash.image import Image
from rig.link.port import open_port
from rig.reasons import errors_become, rig_error

_LOOK_S = 0.2
_CAUSES = {
    # What it says, in lower case, over the versions 6 and 7; the first that fits counts.
    "expected signature for": "flash_other_chip",
    "mismatch": "flash_mismatch",
    "programmer is not responding": "flash_no_loader",
    "timeout": "flash_no_loader",
    "not in sync": "flash_no_loader",
    "": "flash_failed",
}


def write_flash(target: Target, port: str, path: str | None, image: Image, say: Say) -> None:
    """Write an image into a board's flash; avrdude reads it back and compares.

    Parameters
    ----------
    target
        The kind of board.
    port
        Device path.
    path
        Of avrdude; `None`: wherever programs are.
    image
        Intel HEX file.
    say
        Told what happens.

    Raises
    ------
    InputError
        No real port, or no such program.
    DeviceError
        The port cannot be used, or avrdude failed.
    """
    if "://" in port:
        raise rig_error("not_flashable", port=port)
    # Avrdude tries for ever to open a port that is not there, and does not ask who uses it.
    open_port(port).close()
    avrdude = path or "avrdude"
    say(f"writing {image.firmware} ({image.size} bytes) to the {target.board.name} at {port}")
    # -D: a boot loader erases each page as it comes, and knows no erasing of the whole chip.
    writing = ["-D", "-P", port, "-U", f"flash:w:{image.path}:i"]
    command = [avrdude, *target.avrdude.split(), *writing]
    with errors_become("program_failed", OSError, path=avrdude):
        child = Popen(command, errors="replace", stdin=DEVNULL, stdout=PIPE, stderr=STDOUT)
    output = None
    while output is None:
        with suppress(TimeoutExpired):
            output, _ = child.communicate(timeout=_LOOK_S)
        if not os.path.lexists(port):
            child.kill()  # avrdude would try for ever to reach a board that is gone
    say(output.strip())
    if not os.path.lexists(port):
        raise rig_error("flash_broke_off", port=port)
    if child.returncode:
        code = next(code for clue, code in _CAUSES.items() if clue in output.lower())
        raise rig_error(code, port=port, exit_code=child.returncode)
