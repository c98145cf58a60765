"""What the parts of the conformance suite share."""

import pytest

from rig.errors import DeviceError
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Incoming
from rig.records import Drop
from tests.link.bench import GATES, Bench, ScriptedLab, falling_rods
from tests.refusals import refused


class Suite:
    """Tests of a device that `make` puts on a bench."""

    def make(self, lab: ScriptedLab) -> Bench:
        raise NotImplementedError

    @pytest.fixture
    def bench(self) -> Bench:
        return self.make(ScriptedLab(changes=falling_rods()))

    @pytest.fixture
    def device(self, bench) -> Device:
        device = Device(bench.port(), bench.clock())
        device.connect()
        return device

    @pytest.fixture
    def identity(self, device) -> wire.Identity:
        return device.transcript.identity

    @pytest.fixture
    def sensing(self, bench) -> Bench:
        if not bench.can_sense:
            pytest.skip("the release-sense input cannot be driven here")
        return bench

    def check(self, bench: Bench, drop: Drop, identity: wire.Identity, faults=()) -> None:
        """Compare a drop's edges with what the lab did."""
        assert drop.faults == faults
        done = [c for c in bench.lab.changes if GATES >> c[1] & 1]
        assert [(e.channel, e.blocked) for e in drop.edges] == [(c[1], c[2]) for c in done]
        for edge, (seconds, _, _) in zip(drop.edges, done, strict=True):
            self.close(bench, identity, edge.tick, seconds)

    def close(self, bench: Bench, identity: wire.Identity, ticks: int, seconds: float) -> None:
        """Compare times; even a resonator 0.5 % off must fit."""
        expected = seconds * identity.tick_hz
        assert abs(ticks - expected) <= bench.tick_tolerance + 0.005 * expected

    def refused(self, reason: wire.RefusalReason, call, *args, **kwargs) -> DeviceRefusedError:
        error = refused(DeviceRefusedError, "", call, *args, **kwargs)
        assert error.reason is reason
        assert error.hint
        return error

    def heard(self, bench: Bench, device: Device, seconds: float) -> list[wire.Message]:
        """Listen in silence to what the device says of its own accord."""
        end, messages = bench.clock().now_ns() + seconds * 1e9, []
        while bench.clock().now_ns() < end:
            messages += [r.message for r in device.receive() if isinstance(r, Incoming)]
        return messages

    def reconnected(self, bench: Bench, port=None) -> Device:
        """Come to a device that runs, through its port or one that spoils the line."""
        device = Device(port or bench.port(), bench.clock())
        device.connect(boot_wait_s=0)
        return device

    def restart(self, bench: Bench, device: Device) -> None:
        """Press reset, and see that the device says so and is who it was."""
        identity = device.transcript.identity
        bench.reset()
        refused(DeviceError, "restarted", self.heard, bench, device, 3.0)
        assert device.connect(boot_wait_s=0) == identity
