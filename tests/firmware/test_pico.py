"""The Pico's image, in its emulator, against the suite every device must pass."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.errors import InputError
from rig.link.client import Device
from rig.link.port import open_port
from rig_emulator import boards_bench
from rig_emulator.pico_board import USB_RATE, EmulatedPico
from rig_emulator.protocol_emu import EmulatedSerial
from rig_emulator.wiring import PICO
from tests.firmware.pico import build, symbol
from tests.firmware.toolchain import FIRMWARE
from tests.link.bench import Bench, ScriptedLab
from tests.link.conformance import DeviceConformance
from tests.link.talk import record_drop
from tests.refusals import refused
from tests.tables import cases

HZ = 20_000_000


class PicoBench(Bench):
    serial_type = EmulatedSerial
    touch_s = 1e-3  # nothing shorter than 50 ns is seen
    brown_out_cause = 1  # the chip cannot tell it from power

    def __init__(self, lab: ScriptedLab) -> None:
        board = EmulatedPico(PICO, build(), lab, seed=1, ppm=2000, baudrate=USB_RATE)
        super().__init__(lab, board)

    def preset_tick(self, seconds_before_wrap):
        chip = self.now().avr
        looked = symbol("looked") + 2
        upper = 2**16 - round(seconds_before_wrap * HZ) // 2**16
        chip.ahead(upper - int.from_bytes(chip.peek(looked, 2), "little") << 16)
        chip.poke(looked, upper.to_bytes(2, "little"))


@cases
def test_without_its_emulator_it_says_what_to_install(monkeypatch, tmp_path, patched, named, hint):
    monkeypatch.setattr(patched, tmp_path if "HERE" in patched else lambda _: None)
    assert hint in refused(InputError, named, open_port, "emu://?board=pico").hint


@pytest.mark.slow
class TestPico(DeviceConformance):
    @pytest.mark.parametrize("seed", [1])
    def test_one_percent_of_damaged_bytes_changes_nothing(self, bench, seed):
        super().test_one_percent_of_damaged_bytes_changes_nothing(bench, seed)

    def make(self, lab):
        return PicoBench(lab)

    def test_a_short_pulse_is_an_event_and_no_edge(self, bench):
        """Not here: what is seen at all is seen as two edges."""
        pulse = [(0.01, 0, True), (0.01 + 0.2e-6, 0, False)]
        bench.lab.changes = [*pulse, (0.02, 1, True), (0.03, 1, False)]
        device = Device(bench.port(), bench.clock())
        device.connect()
        drop = record_drop(device)
        assert drop.faults == ()
        assert drop.certificate.glitches == 0
        first, second, *_ = drop.edges
        assert (first[1:], second[1:]) == ((0, True), (0, False))
        assert second.tick - first.tick == 4


@pytest.mark.slow
def test_the_table_of_figures_is_up_to_date():
    written = (FIRMWARE.parent / "docs" / "results" / "boards.md").read_text()
    assert boards_bench.page() == written, "./run bench boards -o docs/results"
