"""How well the real binaries stamp: deterministic in the emulator, so it can be asserted."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.protocol import reader
from rig_emulator import trials
from rig_emulator.stand import Flip, Stand
from rig_emulator.wiring import BOARDS
from sim.dials import read_dials
from sim.lab import ChainLab
from tests.firmware.toolchain import FIRMWARE, make

SCENE = str(FIRMWARE.parent / "protocols/inclined-uniform.yaml")


def stand_of(name: str, **changes) -> Stand:
    wiring = BOARDS[name]
    image = f"build/{wiring.mcu}/firmware.elf"
    make(image)
    return Stand(wiring, FIRMWARE / image, **changes)


@pytest.fixture(scope="module", params=list(BOARDS))
def stand(request) -> Stand:
    return stand_of(request.param)


@pytest.fixture(scope="module")
def mega() -> Stand:
    return stand_of("mega")


def test_a_drop_of_both_chains(mega):
    lab = ChainLab(reader.read(SCENE), read_dials({}), seed=3)
    stamps = [stamp for run in (1, 2) for stamp in trials.lab_drop(mega, lab, run)]
    seen = trials.spread(stamps)
    assert seen.count > 1200
    assert abs(seen.mean) < 1
    assert seen.sd <= 1.5
    assert seen.p99 <= 5
    assert seen.worst <= 56
    assert seen.worst_trusted <= 8
    assert 0 < seen.doubtful < 0.06 * seen.count


def test_an_edge_at_every_cycle_around_the_counter_s_turn(stand):
    stamps = trials.across_halves(stand, 200)
    assert len(stamps) == 401
    assert max(abs(stamp.error) for stamp in stamps) <= 8


def test_5000_edges_a_second(mega):
    assert trials.sustained(mega, 1000, 5000) == (1000, 0)


def test_a_board_that_streams_keeps_up_with_4500_edges_a_second():
    assert trials.sustained(stand_of("uno"), 5000, 4500) == (5000, 0)


def test_8000_edges_a_second_at_1_mbaud(mega):
    make("build/1M/atmega2560/firmware.elf")
    fast = Stand(BOARDS["mega"], FIRMWARE / "build/1M/atmega2560/firmware.elf", 1_000_000)
    assert trials.sustained(fast, 1000, 8000) == (1000, 0)


@pytest.mark.parametrize("spacing", [4001, 24_001])
def test_edges_that_meet_are_doubtful_and_not_far_off(mega, spacing):
    """The short spacing leaves the main loop no rest: its time must go on all the same."""
    seen = trials.spread(trials.twins(mega, 250, spacing))
    assert seen.count == 1000
    assert seen.worst <= 56
    assert seen.worst_trusted <= 8


def test_all_gates_in_the_same_cycle_are_one_event(stand):
    gates = range(len(stand.wiring.gates))
    flips = [Flip(30_000, gate, True) for gate in gates]
    flips += [Flip(60_000, gate, False) for gate in gates]
    recording = stand.record(flips, 20)
    assert [event.state for event in recording.events] == [(1 << len(gates)) - 1, 0]
    assert recording.certificate.glitches == 0
    assert max(abs(stamp.error) for stamp in recording.stamps(flips)) <= 8


@pytest.mark.parametrize("gate", [0, 11])
def test_every_short_pulse_is_seen_or_counted(stand, gate):
    for width in range(1, 60):
        edges, glitches = trials.pulse(stand, gate, width)
        assert edges == 2 * (16 - glitches)
        assert not (width < 8 and edges)
        assert not (width > 24 and glitches)


def test_a_talking_host_costs_little(mega):
    flips = trials.train(16, 400, 2000)
    seen = trials.spread(mega.record(flips, 400, noise=bytes(range(1, 256)) * 20).stamps(flips))
    assert seen.worst <= 12


def test_the_stack_has_room_and_the_watchdog_slept(stand):
    assert stand.avr.stack_free() >= 64
    assert stand.avr.watchdog_resets == 0
    assert stand.avr.overruns == 0
