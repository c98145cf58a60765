"""What DMA hands over: a whole drop at the fastest rate there is; and what is said otherwise."""

from itertools import pairwise

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig_emulator.stand import Flip, Stand
from rig_emulator.wiring import PICO
from tests.firmware.pico import build

RODS, GATES = 100, 16
CLOCKS = 18  # from one stamp to the next
GATES_MACHINE = 0


@pytest.fixture(scope="module")
def stand() -> Stand:
    return Stand(PICO, build())


def passages(count: int, gap: int) -> list[Flip]:
    """Rods that all pass all gates, an edge each `gap` cycles."""
    made, at = [], 100_000
    for _rod in range(count):
        for blocked in (True, False):
            for gate in range(GATES):
                made.append(Flip(at, gate, blocked))
                at += gap
    return made


def test_a_drop_of_a_hundred_rods_is_whole_at_the_fastest_rate(stand):
    """3,200 stamps, as close as the machine makes them: fewer than the ring holds by itself."""
    flips = passages(RODS, CLOCKS)
    recording = stand.record(flips, 5)
    assert recording.certificate.events == 2 * RODS * GATES
    assert recording.certificate.overflows == 0
    errors = [stamp.error for stamp in recording.stamps(flips)]
    assert max(errors) - min(errors) < 6
    ticks = [event.tick for event in recording.events]
    assert {later - sooner for sooner, later in pairwise(ticks)} == {CLOCKS // 6}


def test_what_goes_round_the_ring_is_told(stand):
    recording = stand.record(passages(4 * RODS, CLOCKS), 5)
    assert recording.certificate.overflows == 65535
    flips = passages(2, 1000)
    assert len(stand.record(flips, 2).stamps(flips)) == len(flips)


def test_dma_that_comes_too_late_is_told_and_made_good(stand):
    """For 1.25 µs it takes nothing; eight words wait, and half a stamp is lost."""
    flips = passages(2, CLOCKS)

    def late(fire: int) -> list[Flip]:
        stand.avr.dma_late(fire + flips[5].cycle + 150)
        return flips

    assert stand.record(late, 2).certificate.overflows == 65535
    whole = stand.record(flips, 2)
    assert whole.certificate.overflows == 0
    assert len(whole.stamps(flips)) == len(flips)


def test_its_count_of_words_is_begun_anew_before_its_end(stand):
    """After 2^31 stamps: weeks of a gate that flickers."""
    stand.avr.wear(GATES_MACHINE, 7)
    stand.hear(120_000)
    flips = passages(2, 1000)
    assert len(stand.record(flips, 2).stamps(flips)) == len(flips)
