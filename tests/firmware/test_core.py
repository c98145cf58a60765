"""The firmware's core, compiled for the host, against the suite every device must pass."""

from __future__ import annotations

import pytest

from rig.link import messages as wire
from tests.firmware.core_board import BROWN_OUT, CoreBoard
from tests.link.bench import ScriptedLab, falling_rods
from tests.link.conformance import DeviceConformance
from tests.link.talk import Wire
from tests.link.virtual import VirtualBench


class CoreBench(VirtualBench):
    tick_tolerance = 2

    def touch(self, gates):
        super().touch(gates)
        self.clock().sleep(1e-3)  # a shorter pulse would tell that a gate moved, but not which

    def preset_tick(self, seconds_before_wrap):
        self.now().preset(round(-seconds_before_wrap * 16e6) % 2**32)


class TestCore(DeviceConformance):
    def make(self, lab):
        return CoreBench(lab, CoreBoard(lab))

    @pytest.mark.parametrize("byte", [0x00, 0x5A, 0xFF])
    def test_memory_that_was_lost_while_the_power_was_low_is_not_believed(self, bench, byte):
        line = Wire(bench)
        line.drop()
        bench.board.core.host_forget(byte)
        bench.brown_out()
        assert Wire(bench).ask(wire.Status(), 1).phase is wire.Phase.IDLE
        _, certificate = Wire(bench).drop()
        assert certificate.restarts == 128 | BROWN_OUT


class TestStreamingCore(DeviceConformance):
    def make(self, lab):
        return CoreBench(lab, CoreBoard(lab, streams=True))


def test_each_begins_anew_whatever_another_did():
    """Its random numbers too, which come of all that it was ever asked."""

    def spoken() -> list[object]:
        line = Wire(CoreBench(lab := ScriptedLab(changes=falling_rods()), CoreBoard(lab)))
        return [line.ask(wire.Identify(), 1), line.drop(), line.ask(wire.Status(), 9)]

    assert spoken() == spoken()
