"""A firmware image (Intel HEX, UF2): whether it is whole, for which board, and of which version.

Both names are read from the image itself, where the firmware keeps them for `Identity`: so what a
board must answer after flashing is written down nowhere a second time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from rig.errors import InputError, Problem
from rig.files import read_input
from rig.flash.boards import FIRMWARE, TARGETS, Target
from rig.flash.uf2 import read_blocks
from rig.reasons import make_error

_DATA, _END, _SEGMENT, _START_SEGMENT, _LINEAR, _START = range(6)
_ERASED = b"\xff"
_VERSION = re.compile(rb"(%s [0-9][\w.+-]*)\0" % FIRMWARE.encode())


@dataclass(frozen=True, slots=True)
class Image:
    """A firmware image.

    Attributes
    ----------
    path
        The file.
    firmware
        Name and version, as `Identity.firmware` will have it.
    size
        Bytes of flash it needs.
    """

    path: Path
    firmware: str
    size: int


def read_image(file: str | Path | None, target: Target) -> Image:
    """Read an image and see whether it may be flashed.

    Parameters
    ----------
    file
        The file; `None`: the one that comes with this program.
    target
        The board it is meant for.

    Raises
    ------
    InputError
        The file is damaged, is no firmware of this project, or is for another board.
    """
    path = target.shipped if file is None else Path(file)
    try:
        data = read_input(path)
    except OSError as error:
        raise make_error(InputError, "image_unreadable", path=path, text=error) from None
    flash = (_flash if target.avrdude else read_blocks)(data, path)
    versions = set(_VERSION.findall(flash))
    boards = {each.board for each in TARGETS.values() if each.board.name.encode() + b"\0" in flash}
    if len(versions) != 1 or len(boards) != 1:
        raise make_error(InputError, "image_foreign", path=path)
    if boards != {target.board}:
        raise InputError(f"{path} is for {boards.pop().one}, not for {target.board.one}")
    if len(flash) > target.flash_limit:
        raise InputError(f"{path} would overwrite the boot loader of {target.board.one}")
    return Image(path, versions.pop().decode(), len(flash))


def shipped_firmware(board: str) -> str:
    """Say which firmware comes with this program for a board of that name; empty for none."""
    targets = (target for target in TARGETS.values() if target.board.name == board)
    return next((read_image(None, target).firmware for target in targets), "")


def _flash(data: bytes, path: Path) -> bytes:
    """Lay the records out from address 0; what no record fills stays erased."""
    flash = bytearray()
    base = number = 0

    def fault(line: int, text: str) -> InputError:
        return InputError(problems=[Problem(str(path), line, 1, "", text)])

    for number, line in enumerate(data.decode("ascii", "replace").splitlines(), 1):
        try:
            record = bytes.fromhex(line.removeprefix(":"))
        except ValueError:
            record = b""
        if not line.startswith(":") or len(record) < 5 or len(record) != record[0] + 5:
            raise fault(number, "no record of an Intel HEX file")
        if sum(record) & 0xFF:
            raise fault(number, "the checksum is wrong: the file is damaged")
        kind, content = record[3], record[4:-1]
        if kind == _DATA:
            at = base + int.from_bytes(record[1:3], "big")
            if at + len(content) > 1 << 20:
                raise fault(number, "an address beyond any board's flash")
            flash.extend(_ERASED * (at + len(content) - len(flash)))
            flash[at : at + len(content)] = content
        elif kind in {_SEGMENT, _LINEAR}:
            base = int.from_bytes(content, "big") << (4 if kind == _SEGMENT else 16)
        elif kind == _END:
            return bytes(flash)
        elif kind not in {_START_SEGMENT, _START}:
            raise fault(number, f"an unknown kind of record: {kind}")
    raise fault(number, "the end of the file is missing")
