"""Flash, memory and stack of both boards stay within bounds, and the bound on the stack holds."""

import pytest

from firmware.size import measure
from rig.flash.boards import TARGETS
from tests.firmware.toolchain import FIRMWARE, make, need

BOARDS = {"mega": "atmega2560", "uno": "atmega328p"}
SPARE = 64
"""Bytes of stack that must stay unused in the worst case."""


@pytest.mark.parametrize("board", BOARDS)
def test_a_board_has_room(board):
    need("avr-objdump", "avr-nm", "avr-size")
    make("all")
    found = measure(FIRMWARE / "build" / BOARDS[board])
    assert found.stack + SPARE <= found.room, found
    assert found.flash <= TARGETS[board].flash_limit, found
    # A chain of calls that is not found would make the bound too low.
    assert found.path[:2] == ("main", "device_pass"), found
    assert found.path[-1].startswith("__vector_"), found
