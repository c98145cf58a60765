"""The firmware's core, compiled for the host, against the suite every device must pass."""

from __future__ import annotations

from tests.firmware.core_board import CoreBoard
from tests.link.conformance import DeviceConformance
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


class TestStreamingCore(DeviceConformance):
    def make(self, lab):
        return CoreBench(lab, CoreBoard(lab, streams=True))
