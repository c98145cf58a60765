"""The firmware's core, compiled for the host, against the suite every device must pass."""

import pytest

from rig.link import messages as wire
from rig.link.client import Device
from tests.firmware.core_board import BROWN_OUT, CoreBoard
from tests.link.bench import LABEL, Bench
from tests.link.conformance import DeviceConformance
from tests.link.talk import Wire, arm


class CoreBench(Bench):
    tick_tolerance = 2
    touch_s = 1e-3

    def preset_tick(self, seconds_before_wrap):
        self.now().preset(round(-seconds_before_wrap * 16e6) % 2**32)


class TestCore(DeviceConformance):
    def make(self, lab):
        return CoreBench(lab, CoreBoard(lab))

    def test_the_lamp_is_on_while_armed_and_flashes_while_a_drop_is_held(self, bench):
        def seen(seconds):
            found = set()
            for _ in range(20):
                bench.clock().sleep(seconds / 20)
                bench.now()
                found.add(bool(bench.board.core.host_lamp()))
            return found

        device = Device(bench.port(), bench.clock())
        device.connect(boot_wait_s=0)
        assert seen(0.1) == {False}
        token = arm(device, record_ms=50)
        assert seen(0.1) == {True}
        device.fire(token)
        assert seen(0.04) == {True}
        device.collect(LABEL)
        assert seen(1.1) == {True, False}

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
