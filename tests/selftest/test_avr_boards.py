"""Both boards' real binaries, in the emulator, with the wire that a bench would have."""

from __future__ import annotations

import re

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.selftest.findings import Verdict
from rig_emulator.board import EmulatedBoard
from rig_emulator.protocol_emu import EmulatedSerial
from rig_emulator.wiring import BOARDS
from tests.firmware.toolchain import FIRMWARE, make
from tests.selftest.benches import GATE, outcomes


def board_named(name: str) -> EmulatedBoard:
    wiring = BOARDS[name]
    image = f"build/{wiring.mcu}/firmware.elf"
    make(image)
    return EmulatedBoard(wiring, FIRMWARE / image, seed=1, ppm=2000)


def tried(board, **options):
    return outcomes(EmulatedSerial("test", board=board, timeout=0.02), **options)


@pytest.mark.parametrize("name", sorted(BOARDS))
def test_a_board_passes_with_its_wire(name):
    board = board_named(name)
    board.loop_back(GATE)
    found = tried(board, drops=8)
    assert [str(o) for o in found.values() if o.verdict is Verdict.FAILED] == []
    said = found["sync output to gate"].what
    latency, scatter = re.match(r"8 drops, latency (\S+) µs, scatter (\S+) µs", said).groups()
    assert 0.3 < float(latency) < 1.0  # the stamp of FIRE is 8 or 9 cycles ahead of its pins
    assert float(scatter) < 0.3
    releases = [change for change in board.history if change.pin in board.wiring.releases]
    assert len(releases) == 2  # on, and off again


@pytest.mark.parametrize("name", sorted(BOARDS))
def test_without_leave_no_release_moves_and_without_a_wire_no_edge_comes(name):
    board = board_named(name)
    found = tried(board, drops=1, release=False)
    assert [n for n, o in found.items() if o.verdict is Verdict.FAILED] == ["sync output to gate"]
    assert not [change for change in board.history if change.pin in board.wiring.releases]
    assert [change for change in board.history if change.pin == board.wiring.sync]
