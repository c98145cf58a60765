"""A board's own name is a name: no empty memory, no damaged one, and no two alike."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig_emulator.name import NAME_AT
from rig_emulator.wiring import BOARDS
from tests.firmware.test_stamps import stand_of

EACH = pytest.mark.parametrize("board", BOARDS)


@EACH
def test_boards_whose_memory_was_cleared_get_names_of_their_own(board):
    names = [stand_of(board, named=b"", waits=waits).identity.unique_id for waits in (0, 997, 5000)]
    assert len({*names, bytes(8)}) == 4


@EACH
@pytest.mark.parametrize("at", [0, 5, 11])
def test_a_damaged_name_is_none_and_is_replaced_once(board, at):
    stand = stand_of(board)
    assert stand.identity.unique_id == b"on stand"
    (byte,) = stand.avr.eeprom_read(NAME_AT + at, 1)
    stand.avr.eeprom_write(NAME_AT + at, bytes([byte ^ 4]))
    new = stand.ask(wire.Identify()).unique_id
    assert new != b"on stand"
    stand.avr.reset()
    stand.hear(1_000_000)
    assert stand.ask(wire.Identify()).unique_id == new
