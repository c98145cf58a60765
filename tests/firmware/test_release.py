"""The release of the real binaries: hardware ends its pulse, whatever the gates and the loop do."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link.messages import PulseEnd
from rig_emulator import trials
from rig_emulator.stand import Flip, Stand
from rig_emulator.wiring import BOARDS
from tests.firmware.test_stamps import stand_of

_US = 16


@pytest.fixture(scope="module", params=list(BOARDS))
def stand(request) -> Stand:
    return stand_of(request.param)


def pulses(stand: Stand, recording) -> list[list[int]]:
    """Say when each release changed."""
    return [[c.cycle for c in recording.outputs if c.pin == pin] for pin in stand.wiring.releases]


@pytest.mark.parametrize("rate", [100_000, 320_000, 400_000, 1_000_000])
def test_gates_that_never_rest_do_not_lengthen_it(stand, rate):
    recording = trials.storm(stand, rate, 20_000)
    assert pulses(stand, recording) == [[0, 20_000 * _US]] * 2
    assert recording.certificate.pulse_ticks == 20_000 * _US
    assert recording.certificate.pulse_end == PulseEnd.ORDERED
    assert recording.certificate.overflows > 0
    assert stand.avr.watchdog_resets == 0
    flips = trials.train(len(stand.wiring.gates), 100, 2000)
    seen = trials.spread(stand.record(flips, 80).stamps(flips))
    assert seen.worst <= 8, "its time went on"


@pytest.mark.parametrize("pulse_us", [1, 10, 4_090, 4_097, 61_000])
def test_a_pulse_is_as_long_as_ordered(stand, pulse_us):
    stand.hear(200_000 * _US)  # it rests three times as long as it was on
    recording = stand.record([], pulse_us // 1000 + 2, pulse_us=pulse_us)
    for on, off in pulses(stand, recording):
        assert on == 0
        assert off == pulse_us * _US or (pulse_us < 10 and off <= 30 * _US)
        assert abs(recording.certificate.pulse_ticks - off) <= 2 * _US


def test_the_sync_output_is_with_it(stand):
    stand.hear(200_000 * _US)
    recording = stand.record([Flip(1000, 0, True)], 5, pulse_us=1000)
    sync = [c.cycle for c in recording.outputs if c.pin == stand.wiring.sync]
    assert -4 <= sync[0] <= 0
    assert abs(sync[1] / 16e3 - 5) < 0.5


@pytest.mark.parametrize("name", list(BOARDS))
def test_a_main_loop_that_stands_still_ends_it_and_restarts_the_board(name):
    stand = stand_of(name)
    avr = stand.avr
    stand.arm_and_fire(500, 400_000)
    stand.hear(20_000 * _US)
    assert all(map(avr.output, stand.wiring.releases))
    avr.take_changes()
    avr.hang("device_pass")
    still = avr.cycle
    stand.hear(200_000 * _US)
    ends = [c.cycle - still for c in avr.take_changes() if c.pin in stand.wiring.releases]
    assert len(ends) == 2
    assert max(ends) < 4_100 * _US
    assert avr.watchdog_resets > 0
