"""UF2, the form of a file that a Pico's drive takes: blocks of 512 bytes, each with its address."""

from __future__ import annotations

import struct
from pathlib import Path

from rig.errors import InputError

_LAYOUT = struct.Struct("<8I476sI")
_MAGIC = (0x0A324655, 0x9E5D5157)
_END = 0x0AB16F30
_RP2040 = 0xE48BFF56
_FLASH = 0x10000000
_PAYLOAD = 256


def read_blocks(data: bytes, path: Path) -> bytes:
    """Read the flash that a file fills, from its first address on.

    Parameters
    ----------
    data, path
        The file, and its name for messages.

    Raises
    ------
    InputError
        It is no UF2, not for an RP2040, or not whole.
    """
    if not data or len(data) % _LAYOUT.size:
        raise InputError(f"{path} is no whole UF2 file")
    flash = bytearray()
    blocks = list(_LAYOUT.iter_unpack(data))
    for n, block in enumerate(blocks):
        first, second, _, address, size, number, count, family, content, end = block
        if (first, second, end) != (*_MAGIC, _END):
            raise InputError(f"{path} is no UF2 file, or damaged: block {n}")
        if family != _RP2040:
            raise InputError(f"{path} is not for an RP2040: block {n}")
        order = (number, count, size, address)
        if order != (n, len(blocks), _PAYLOAD, _FLASH + n * _PAYLOAD):
            raise InputError(f"{path} is not whole: block {n} is another one")
        flash += content[:size]
    return bytes(flash)
