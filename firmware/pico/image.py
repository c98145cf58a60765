"""Make the file that is copied to a Pico: ``image.py FAMILY FIRMWARE.bin FIRMWARE.uf2``.

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
_BEGIN = (0x0A324655, 0x9E5D5157, 0x2000)
"""What a block begins with, and that it says for which family of chips it is."""
_END = 0x0AB16F30
_RP2040 = 0xE48BFF56


def boot_check(code: bytes) -> int:
    """Compute the CRC-32 of the boot program: 0x04C11DB7, not reflected, nothing added."""
    crc = 0xFFFFFFFF
    for byte in code:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc >> 31 else 0)) & 0xFFFFFFFF
    return crc


def checked(flash: bytes) -> bytes:
    """Put the check in its place, which is empty (image.ld)."""
    return flash[:BOOT] + struct.pack("<I", boot_check(flash[:BOOT])) + flash[PIECE:]


def uf2(flash: bytes, family: int) -> bytes:
    """Write what is to be in flash, from its beginning, as blocks of UF2."""
    count, blocks = -(-len(flash) // PIECE), b""
    for n in range(count):
        at = n * PIECE
        head = struct.pack("<8I", *_BEGIN, FLASH + at, PIECE, n, count, family)
        blocks += head + flash[at : at + PIECE].ljust(476, b"\0") + struct.pack("<I", _END)
    return blocks


if __name__ == "__main__":
    family, flash = int(sys.argv[1], 16), Path(sys.argv[2]).read_bytes()
    Path(sys.argv[3]).write_bytes(uf2(checked(flash) if family == _RP2040 else flash, family))
