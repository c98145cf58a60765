# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware files: ELF with its symbols, or Intel HEX without."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_AVR = 83  # e_machine
_LOAD = 1  # p_type
_SYMBOLS = 2  # sh_type
_NAMED = {0, 1, 2}  # symbol types: none (the linker's), object, function
# Where avr-gcc's linker puts the parts of a Harvard machine into one address space.
_RAM = 0x800000
_EEPROM = 0x810000
_FUSES = 0x820000


class Symbol(NamedTuple):
    """A named place: `address` in RAM, or in flash when `flash`; `size` in bytes."""

    address: int
    size: int
    flash: bool


@dataclass(frozen=True, slots=True)
class Image:
    """What is to be programmed: pieces as (address, bytes); a reset begins at `start`."""

    flash: list[tuple[int, bytes]]
    eeprom: list[tuple[int, bytes]] = field(default_factory=list)
    symbols: dict[str, Symbol] = field(default_factory=dict)
    start: int = 0


def read_image(path: Path) -> Image:
    """Read a firmware file.

    Parameters
    ----------
    path
        An ELF for AVR, or Intel HEX.

    Raises
    ------
    InputError
        When it is neither, or cannot be read.
    """
    try:
        data = path.read_bytes()
        return _read_elf(data) if data.startswith(b"\x7fELF") else _read_hex(data)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, IndexError, struct.error) as error:
        raise InputError(f"{path} is no AVR firmware: {error}") from None


def _read_elf(data: bytes) -> Image:
    machine = struct.unpack_from("<H", data, 18)[0]
    if data[4:6] != b"\1\1" or machine != _AVR:
        raise ValueError(f"an ELF for another machine ({machine})")
    programs, sections = struct.unpack_from("<II", data, 28)
    program_size, program_count, section_size, section_count = struct.unpack_from("<4H", data, 42)
    image = Image([])
    for n in range(program_count):
        kind, offset, _, load, size = struct.unpack_from("<5I", data, programs + n * program_size)
        if kind == _LOAD and size and not _RAM <= load < _EEPROM and load < _FUSES:
            piece = data[offset : offset + size]
            if load < _RAM:
                image.flash.append((load, piece))
            else:
                image.eeprom.append((load - _EEPROM, piece))
    tables = [
        struct.unpack_from("<10I", data, sections + n * section_size) for n in range(section_count)
    ]
    for table in tables:
        if table[1] == _SYMBOLS:
            names = tables[table[6]][4]
            image.symbols.update(_read_symbols(data, table[4], table[5], names))
    return image


def _read_symbols(data: bytes, at: int, size: int, names: int) -> Iterator[tuple[str, Symbol]]:
    for name, value, length, info, _, section in struct.iter_unpack(
        "<IIIBBH", data[at : at + size]
    ):
        if name and section and info & 15 in _NAMED:
            start = names + name
            text = data[start : data.index(b"\0", start)].decode()
            flash = value < _RAM
            yield text, Symbol(value if flash else value - _RAM, length, flash)


def _read_hex(data: bytes) -> Image:
    image, base = Image([]), 0
    for number, line in enumerate(data.decode("ascii").split(), start=1):
        record = bytes.fromhex(line.removeprefix(":"))
        if not line.startswith(":") or len(record) != record[0] + 5 or sum(record) & 0xFF:
            raise ValueError(f"line {number}: neither ELF nor Intel HEX, or damaged")
        address, kind, piece = int.from_bytes(record[1:3]), record[3], record[4:-1]
        if kind == 0:
            image.flash.append((base + address, piece))
        elif kind == 1:
            return image
        elif kind in {2, 4}:
            base = int.from_bytes(piece) << (4 if kind == 2 else 16)
    raise ValueError("it has no end: the file was cut short")
