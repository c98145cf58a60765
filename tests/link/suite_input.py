"""The 1 Hz reference and the release sense."""

import pytest

from rig.link import messages as wire
from tests.link.suite import Suite


class InputSuite(Suite):
    def test_without_a_pulse_the_reference_is_empty(self, device):
        assert device.reference() == wire.ReferencePulse(0, 0)

    def test_reference_pulses_are_counted_and_timed(self, bench, device, identity):
        if not bench.can_reference:
            pytest.skip("no reference can be given here")
        bench.reference([0.05, 0.15, 0.25])
        bench.clock().sleep(0.1)
        first = device.reference()
        assert first.count == 1
        assert device.reference() == first
        bench.clock().sleep(0.2)
        third = device.reference()
        assert third.count == 3
        self.close(bench, identity, (third.tick - first.tick) % 2**32, 0.2)
        now = device.ping().tick
        assert (now - third.tick) % 2**32 < 0.2 * identity.tick_hz

    def test_the_release_sense_is_timed(self, bench, device, identity):
        if not bench.can_sense:
            pytest.skip("the release-sense input cannot be driven here")
        bench.sense(0.012)
        drop = self.drop(device)
        self.check(bench, drop, identity)
        self.close(bench, identity, drop.certificate.release_sense, 0.012)

    def test_without_a_change_there_is_no_release_sense(self, device):
        assert self.drop(device).certificate.release_sense is None

    def test_a_change_behind_the_recording_is_not_of_the_drop(self, bench, device):
        if not bench.can_sense:
            pytest.skip("the release-sense input cannot be driven here")
        bench.sense(0.1)
        assert self.drop(device, record_ms=50).certificate.release_sense is None
