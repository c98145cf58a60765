"""A firmware image (Intel HEX, UF2): whether it is whole, for which board, and of which version.

Both names are read from the image itself, where the firmware keeps them for `Identity`: so what a
board must answer after flashing is written down nowhere a second time.
"""

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rig.errors import InputError, Problem
from rig.files import read_input
from rig.flash.boards import TARGETS, Target
from rig.reasons import errors_become, rig_error

_DATA, _END = 0, 1
_BASES = {2: 4, 4: 16}
"""Kinds of record that say where the next ones are, and how far their number is shifted."""
_KINDS = {_DATA, _END, *_BASES, 3, 5}  # the last two name a program's start, which boards know
_RECORD = re.compile(":(?:[0-9A-Fa-f]{2}){5,}")
_BLOCK = struct.Struct("<8I476sI")
_PAYLOAD = 256
_VERSION = re.compile(rb"(chainrig [0-9][\w.+-]*)\0")


class Image(NamedTuple):
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
    path = target.image_path if file is None else Path(file)
    with errors_become("image_unreadable", OSError, path=path):
        data = read_input(path)
    flash = bytearray()
    for at, content in (_read_records if target.avrdude else _read_blocks)(data, path):
        if at + len(content) > target.flash_limit:
            raise InputError(f"{path} would overwrite the boot loader of {target.board.one}")
        flash.extend(b"\xff" * (at + len(content) - len(flash)))
        flash[at : at + len(content)] = content
    versions = set(_VERSION.findall(flash))
    boards = {each.board for each in TARGETS.values() if each.board.name.encode() + b"\0" in flash}
    if len(versions) != 1 or len(boards) != 1:
        raise rig_error("image_foreign", path=path)
    if boards != {target.board}:
        raise InputError(f"{path} is for {boards.pop().one}, not for {target.board.one}")
    return Image(path, versions.pop().decode(), len(flash))


def shipped_firmware(board: str) -> str:
    """Say which firmware comes with this program for a board of that name; empty for none."""
    targets = (target for target in TARGETS.values() if target.board.name == board)
    return next((read_image(None, target).firmware for target in targets), "")


def _read_records(data: bytes, path: Path) -> Iterator[tuple[int, bytes]]:
    """Give address and content of each record of an Intel HEX file that has any."""
    base = 0
    lines = data.decode("ascii", "replace").splitlines()
    for number, line in enumerate([*lines, ""], 1):
        record = bytes.fromhex(line[1:]) if _RECORD.fullmatch(line) else b"\0"
        if len(record) != record[0] + 5 or sum(record) & 0xFF or record[3] not in _KINDS:
            text = "no whole record of an Intel HEX file, whose last is :00000001FF"
            raise InputError(problems=[Problem(str(path), number, 1, "", text)])
        kind, content = record[3], record[4:-1]
        if kind == _DATA:
            yield base + int.from_bytes(record[1:3], "big"), content
        elif kind in _BASES:
            base = int.from_bytes(content, "big") << _BASES[kind]
        elif kind == _END:
            return


def _read_blocks(data: bytes, path: Path) -> Iterator[tuple[int, bytes]]:
    """Give place in the flash and content of each block of a UF2 file, which a Pico's drive takes.

    A block has 512 bytes, among them its address.
    """
    count, rest = divmod(len(data), _BLOCK.size)
    if rest or not count:
        raise InputError(f"{path} is no whole UF2 file")
    for n, (*head, content, end) in enumerate(_BLOCK.iter_unpack(data)):
        at = n * _PAYLOAD
        # Two magic numbers and the flag that a family of chips is named; then the address, in the
        # flash that begins at 0x10000000, and the sizes; then the family (RP2040) and the end.
        magic, family = (0x0A324655, 0x9E5D5157, 0x2000), (0xE48BFF56, 0x0AB16F30)
        if (*head, end) != (*magic, 0x10000000 + at, _PAYLOAD, n, count, *family):
            raise InputError(f"{path} is damaged, or not for an RP2040: block {n}")
        yield at, content[:_PAYLOAD]
