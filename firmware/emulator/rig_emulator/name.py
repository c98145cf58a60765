# SPDX-License-Identifier: GPL-3.0-or-later
"""A board's own name, as the firmware keeps it in the EEPROM."""

from rig.link.frames import crc16

NAME_AT = 0x40
"""Where its record begins."""
_MARK = b"CR"


def name_record(name: bytes) -> bytes:
    """Write the record of `firmware/core/name.h`: mark, eight bytes of name, CRC-16."""
    marked = _MARK + name
    return marked + crc16(marked).to_bytes(2, "little")
