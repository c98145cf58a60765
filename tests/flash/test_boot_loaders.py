"""``rig flash`` with the real avrdude, against Arduino's own boot loaders, in the emulator."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.cli import main
from rig.flash.boards import TARGETS
from rig.link.client import Device
from rig.link.messages import Phase
from rig.link.port import open_port, port_clock
from rig_emulator.bootloader import BoughtBoard
from rig_emulator.wiring import BOARDS
from tests.firmware.toolchain import need
from tests.link.bench import LABEL
from tests.waiting import until

LOADERS = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders")
BOUGHT = {
    "mega": "stk500v2/stk500boot_v2_mega2560.hex",
    "uno": "optiboot/optiboot_atmega328.hex",
}


def bought(board: str) -> BoughtBoard:
    need("avrdude")
    loader = LOADERS / BOUGHT[board]
    if not loader.exists():
        pytest.skip("not installed: arduino-core-avr")
    return BoughtBoard(BOARDS[board].mcu, loader)


@pytest.mark.parametrize("board", TARGETS)
def test_a_new_board_is_flashed_and_its_drops_outlive_the_boot_loader(board, capsys):
    with bought(board) as there:
        code = main(["flash", "--board", board, "--port", there.path])
        out, err = capsys.readouterr()
        assert code == 0, err
        assert out.startswith(TARGETS[board].board.name)
        assert out.endswith(": flashed and verified\n")
        fallen = drop(there, board)
        until(lambda: not there.is_open)
        before = there.restarts
        with closing(open_port(there.path)) as port:
            device = Device(port, port_clock(port))
            device.connect()
            assert device.status().phase is Phase.HOLDING
            assert device.fetch(LABEL) == fallen
        assert there.restarts == before + 1


def drop(there: BoughtBoard, board: str):
    """Let a drop of forty edges be recorded, and leave it in the board."""
    wiring = BOARDS[board]
    with there.lock:
        for pin in (*wiring.gates, wiring.stop):
            there.avr.edge(0, pin, False)
    with closing(open_port(there.path)) as port:
        device = Device(port, port_clock(port))
        device.connect()
        order = {"release": 1, "pulse_us": 20_000, "timeout_ms": 2000, "record_ms": 200}
        device.fire(device.arm(label=LABEL, gates=1, **order))
        with there.lock:
            for n in range(40):
                there.avr.edge(there.avr.cycle + 1000 * (n + 1), wiring.gates[0], n % 2 == 0)
        fallen = device.collect(LABEL)
    assert len(fallen.edges) == 40
    assert fallen.faults == ()
    return fallen
