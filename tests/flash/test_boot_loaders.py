"""``rig flash`` with the real avrdude, against Arduino's own boot loaders, in the emulator."""

import random
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.flash.boards import TARGETS
from rig.link.client import Device
from rig.link.messages import Phase
from rig.link.port import open_port
from rig_emulator.board import EmulatedBoard
from rig_emulator.bootloader import LOADERS, BoughtBoard, behind_loader
from rig_emulator.protocol_emu import EmulatedSerial
from rig_emulator.wiring import BOARDS, Wiring, firmware_for
from sim.clock import VirtualClock
from tests.firmware.toolchain import need
from tests.link.bench import LABEL
from tests.link.talk import arm
from tests.waiting import until

WRITTEN = 3000
"""Bytes of a flash under way."""


@dataclass(frozen=True)
class BoardTime:
    """An emulated board's own time, which runs slower beside busy programs."""

    board: BoughtBoard

    def now_ns(self) -> int:
        return round(self.board.avr.cycle / self.board.avr.frequency * 1e9)

    def sleep(self, seconds: float) -> None:
        end = self.now_ns() + round(seconds * 1e9)
        until(lambda: self.now_ns() >= end)


@pytest.fixture
def bought(tmp_path):
    need("avrdude")

    def buy(board: str) -> BoughtBoard:
        if not LOADERS[board].exists():
            pytest.skip("not installed: arduino-core-avr")
        return BoughtBoard(wiring_of(board).mcu, LOADERS[board], tmp_path / "ttyACM0")

    return buy


def wiring_of(board: str) -> Wiring:
    return next(w for word, w in BOARDS.items() if TARGETS[word].board is TARGETS[board].board)


@pytest.mark.parametrize(
    ("board", "power"),
    [("mega", True), pytest.param("uno", False, marks=pytest.mark.slow), ("nano-old", False)],
)
def test_a_board_cut_off_in_mid_flash_is_flashed_again_and_its_drops_outlive_the_boot_loader(
    board, power, bought, flash
):
    with bought(board) as there:
        with ThreadPoolExecutor(1) as hand:

            def cut() -> None:
                until(lambda: there.heard > WRITTEN)
                there.pull(power=power)

            hands = hand.submit(cut)
            done = flash("--port", there.path, board=board, code=4)
            hands.result()
        assert f"flashing {there.path} failed: the connection broke" in done.err
        there.plug()
        done = flash("--port", there.path, board=board)
        assert done.out.startswith(TARGETS[board].board.name)
        assert done.out.endswith(": flashed and verified\n")
        fallen = drop(there, wiring_of(board))
        until(lambda: not there.is_open)
        before = there.restarts
        with closing(open_port(there.path)) as port:
            device = Device(port, BoardTime(there))
            device.connect()
            assert device.status().phase is Phase.HOLDING
            assert device.fetch(LABEL) == fallen
        assert there.restarts == before + 1


@pytest.mark.slow
def test_another_chip_than_the_board_that_was_named_is_not_written(bought, flash):
    with bought("uno") as there:
        before = there.avr.program(0, 256)
        assert "wrong --board" in flash("--port", there.path, code=4).err
        assert there.avr.program(0, 256) == before


def test_no_opening_within_a_boot_loader_takes_longer_than_five_seconds():
    """Where opening does not reset, and others have sent bytes, only asking it to leave helps."""
    if not LOADERS["mega"].exists():
        pytest.skip("not installed: arduino-core-avr")
    wiring, chance = BOARDS["mega"], random.Random(5)
    image = behind_loader(wiring.mcu, LOADERS["mega"], firmware_for(wiring))
    board, clock = EmulatedBoard(wiring, image), VirtualClock()
    for n in range(4):
        port = EmulatedSerial("test", board=board, timeout=0.02, clock=clock)
        for _ in range(n % 3 and chance.randrange(8)):
            clock.sleep(chance.uniform(0.05, 0.3))
            port.write(chance.randbytes(8))
        clock.sleep(chance.uniform(0.0, 1.5))
        port.close()
        board.line.read(clock.now_ns())  # as the kernel, which forgets what nobody has read
        resets = n % 2 == 0
        port = EmulatedSerial("test", board=board, timeout=0.02, clock=clock, reset_on_open=resets)
        began_ns = clock.now_ns()
        Device(port, clock).connect()
        assert clock.now_ns() - began_ns < 5e9
        port.close()


def drop(there: BoughtBoard, wiring: Wiring):
    """Let a drop of forty edges be recorded, and leave it in the board."""
    with there.lock:
        for pin in (*wiring.gates, wiring.stop):
            there.avr.edge(0, pin, False)
    with closing(open_port(there.path)) as port:
        device = Device(port, BoardTime(there))
        device.connect()
        device.fire(arm(device, gates=1, record_ms=200))
        with there.lock:
            for n in range(40):
                there.avr.edge(there.avr.cycle + 1000 * (n + 1), wiring.gates[0], n % 2 == 0)
        fallen = device.collect(LABEL)
    assert len(fallen.edges) == 40
    assert fallen.faults == ()
    return fallen
