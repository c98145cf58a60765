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

if TYPE_CHECKING:
    from pathlib import Path

    from rig.flash.boards import AvrTarget

_LOOK_S = 0.2
_RESET = "wrong --board (nano-old for an old Nano)? Press the board's reset button and try again"
_CAUSES = (
    # What it says, in lower case, over the versions 6 and 7; the first that fits counts.
    (
        "expected signature for",
        "the chip on this port is another one than --board says",
        "look at what is printed on the board: --board mega or --board uno",
    ),
    (
        "mismatch",
        "what was read back is not what was written",
        "try once more, with another cable; if it stays so, the board's flash is worn out",
    ),
    ("permission denied", "permission denied", "join the group that owns it (often dialout)"),
    ("busy", "another program uses it", "close that program"),
    ("no such file", "it is gone", "was the board unplugged?"),
    ("programmer is not responding", "its boot loader does not answer", _RESET),
    ("timeout", "its boot loader does not answer", _RESET),
    ("not in sync", "its boot loader does not answer", _RESET),
)


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
        raise InputError(f"{path} is no program that can be run")
    raise InputError("avrdude is not installed", "apt-get install avrdude, or say --avrdude PATH")


def write_flash(avrdude: str, target: AvrTarget, port: str, image: Path) -> None:
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
    command = [avrdude, "-p", target.part, "-c", target.programmer, "-b", str(target.baudrate)]
    # -D: a boot loader erases each page as it comes, and knows no erasing of the whole chip.
    command += ["-D", "-P", port, "-U", f"flash:w:{image}:i"]
    try:
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            bufsize=0,
        )
    except OSError as error:
        raise InputError(f"cannot run {avrdude}: {error.strerror}") from error
    with child:
        output = _relay_output(child, port)
    if not os.path.lexists(port):
        raise DeviceError(
            f"flashing {port} failed: the connection broke",
            "plug the board in again and flash it once more: its boot loader was not touched",
        )
    if child.returncode:
        raise DeviceError(*_cause(port, child.returncode, output))


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


def _cause(port: str, code: int, output: str) -> tuple[str, str]:
    lower = output.lower()
    for clue, cause, hint in _CAUSES:
        if clue in lower:
            return f"flashing {port} failed: {cause}", hint
    return f"flashing {port} failed: avrdude ended with {code}", "see its last lines above"
