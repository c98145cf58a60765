"""Make the file that is copied to a Pico: ``image.py rp2040 FIRMWARE.bin FIRMWARE.uf2``.

An RP2040's boot program calls the first 256 bytes of flash only if the last four of them are the
CRC-32 of the others (data sheet, 2.8.1.3.1); UF2 is 256 bytes of flash in blocks of 512, each with
its address (github.com/microsoft/uf2).
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

FLASH = 0x10000000
BOOT = 252
"""Bytes that the boot program checks."""
PIECE = 256
_MAGIC = (0x0A324655, 0x9E5D5157)
_END = 0x0AB16F30
_WITH_FAMILY = 0x2000
FAMILIES = {"rp2040": 0xE48BFF56, "rp2350": 0xE48BFF59}
"""Of chips; the second one's for secure code of its Arm processors."""


def boot_check(code: bytes) -> int:
    """Compute the CRC-32 of the boot program: 0x04C11DB7, not reflected, nothing added."""
    crc = 0xFFFFFFFF
    for byte in code:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc >> 31 else 0)) & 0xFFFFFFFF
    return crc


def checked(flash: bytes) -> bytes:
    """Put the check in its place.

    Raises
    ------
    ValueError
        When something else is there.
    """
    if any(flash[BOOT:PIECE]):
        raise ValueError("the boot code is longer than 252 bytes")
    return flash[:BOOT] + struct.pack("<I", boot_check(flash[:BOOT])) + flash[PIECE:]


def uf2(flash: bytes, family: int) -> bytes:
    """Write what is to be in flash, from its beginning, as blocks of UF2."""
    pieces = [flash[at : at + PIECE] for at in range(0, len(flash), PIECE)]
    blocks = []
    for n, piece in enumerate(pieces):
        head = struct.pack(
            "<8I", *_MAGIC, _WITH_FAMILY, FLASH + n * PIECE, PIECE, n, len(pieces), family
        )
        blocks.append(head + piece.ljust(476, b"\0") + struct.pack("<I", _END))
    return b"".join(blocks)


if __name__ == "__main__":
    chip, firmware, image = sys.argv[1:]
    content = Path(firmware).read_bytes()
    Path(image).write_bytes(uf2(checked(content) if chip == "rp2040" else content, FAMILIES[chip]))
