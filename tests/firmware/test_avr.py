"""Both boards' real binaries, in the emulator, against the suite every device must pass."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig_emulator.board import EmulatedBoard
from rig_emulator.protocol_emu import EmulatedSerial
from rig_emulator.wiring import BOARDS
from tests.firmware.toolchain import FIRMWARE, make
from tests.link.bench import ScriptedLab
from tests.link.conformance import DeviceConformance
from tests.link.virtual import VirtualBench

_TURN_TICKS = 1 << 16


class AvrBench(VirtualBench):
    serial_type = EmulatedSerial
    touch_s = 1e-3
    tick_tolerance = 5  # an edge waits for the instruction that it interrupts

    def __init__(self, lab: ScriptedLab, name: str) -> None:
        wiring = BOARDS[name]
        image = f"build/{wiring.mcu}/firmware.elf"
        make(image)
        self.can_sense = wiring.sense is not None
        super().__init__(lab, EmulatedBoard(wiring, FIRMWARE / image, lab, seed=1, ppm=2000))

    def preset_tick(self, seconds_before_wrap):
        avr = self.now().avr
        upper = 2**16 - round(seconds_before_wrap * 16e6) // _TURN_TICKS
        lower = avr.peek("looked")[:2]  # must go on with the counter
        avr.poke("looked", lower + upper.to_bytes(2, "little"))


class AvrConformance(DeviceConformance):
    # The emulator needs long for what is mostly waiting: one bad line is enough here.
    @pytest.mark.parametrize("seed", [1])
    def test_one_percent_of_damaged_bytes_changes_nothing(self, bench, seed):
        super().test_one_percent_of_damaged_bytes_changes_nothing(bench, seed)


class TestMega(AvrConformance):
    def make(self, lab):
        return AvrBench(lab, "mega")


class TestUno(AvrConformance):
    def make(self, lab):
        return AvrBench(lab, "uno")
