"""Calling avrdude, showing what it says, and saying what went wrong."""

from __future__ import annotations

import os
import select
import shutil
import subprocess
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from rig.errors import DeviceError, InputError
from rig.reasons import make_error

if TYPE_CHECKING:
    from pathlib import Path

    from rig.flash.boards import Target

_LOOK_S = 0.2
_CAUSES = {
    # What it says, in lower case, over the versions 6 and 7; the first that fits counts.
    "expected signature for": "flash_other_chip",
    "mismatch": "flash_mismatch",
    "permission denied": "flash_denied",
    "busy": "flash_busy",
    "no such file": "flash_port_gone",
    "programmer is not responding": "flash_no_loader",
    "timeout": "flash_no_loader",
    "not in sync": "flash_no_loader",
}


def find_avrdude(path: str | None) -> str:
    """Find the program.

    Parameters
    ----------
    path
        Where the user says it is; `None`: wherever programs are.

    Raises
    ------
    InputError
        It is not there.
    """
    program = shutil.which(path or "avrdude")
    if program:
        return program
    if path:
        raise make_error(InputError, "no_program", path=path)
    raise make_error(InputError, "no_avrdude")


def write_flash(avrdude: str, target: Target, port: str, image: Path) -> None:
    """Write an image into a board's flash; avrdude reads it back and compares.

    Parameters
    ----------
    avrdude
        The program.
    target
        The kind of board.
    port
        Device path.
    image
        Intel HEX file.

    Raises
    ------
    DeviceError
        Avrdude failed.
    """
    # -D: a boot loader erases each page as it comes, and knows no erasing of the whole chip.
    writing = ["-D", "-P", port, "-U", f"flash:w:{image}:i"]
    try:
        child = subprocess.Popen(
            [avrdude, *target.avrdude.split(), *writing],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            bufsize=0,
        )
    except OSError as error:
        raise make_error(InputError, "program_failed", path=avrdude, text=error) from error
    with child:
        output = _relay_output(child, port)
    if not os.path.lexists(port):
        raise make_error(DeviceError, "flash_broke_off", port=port)
    if child.returncode:
        codes = (code for clue, code in _CAUSES.items() if clue in output.lower())
        code = next(codes, "flash_failed")
        raise make_error(DeviceError, code, port=port, exit_code=child.returncode)


def _relay_output(child: subprocess.Popen[bytes], port: str) -> str:
    """Pass on what a program says as it says it: its progress is a line that grows."""
    output = bytearray()
    assert child.stdout is not None
    while True:
        readable, _, _ = select.select([child.stdout], [], [], _LOOK_S)
        if not os.path.lexists(port):
            child.kill()  # avrdude would try for ever to reach a board that is gone
        if readable:
            chunk = child.stdout.read(4096)
            if not chunk:
                return output.decode(errors="replace")
            output += chunk
            with suppress(OSError):
                sys.stderr.write(chunk.decode(errors="replace"))
                sys.stderr.flush()
