"""A second opinion: the Uno's binary in avr8js, another author's emulator, beside the first.

avr8js shares no code with simavr and none with our harness. It also has what simavr lacks: a read
of the counter's low byte overwrites the high byte that another read has latched.

Where the two differ:

- avr8js enters an interrupt in 2 cycles, our harness as silicon in 4: every stamp is 2 earlier;
- avr8js's transmitter has no buffer: each byte takes longer by a turn of the firmware's loop.

avr8js reads the counter one cycle later, in FIRE as in stamps, which cancels. It has no input
capture, so the reference is tested with the first emulator only.
"""

import struct
import subprocess
import zlib
from pathlib import Path

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig_emulator import stand as stands
from rig_emulator import trials
from rig_emulator.stand import Flip, Recording, Stand
from rig_emulator.wiring import BOARDS
from tests.firmware.avr8js.avr import Avr8js, install
from tests.firmware.toolchain import make, need

pytestmark = pytest.mark.slow

UNO = BOARDS["uno"]
ENTRY = 2 - 4
"""What the two emulators' interrupt entries make of the stamps, cycles."""
TWINS = {0: 3, 1: 9, 2: 10, 6: 4, 7: 11, 8: 5}  # on the same port and on the other, either way
TURNS = 6000
"""Cycles after which the main loop has looked at the release again, whatever else it does."""
LAGS = (0, 0, 16, 30, 120, 400)
"""Cycles by which a twin follows: one event with its leader, waiting for the interrupt, or late."""


@pytest.fixture(scope="module")
def image(tmp_path_factory) -> Path:
    install()
    need("avr-objcopy")
    path = tmp_path_factory.mktemp("avr8js") / "firmware.hex"
    program = make("build/atmega328p/firmware.elf")
    subprocess.run(["avr-objcopy", "-O", "ihex", "-R", ".eeprom", program, path], check=True)
    return path


@pytest.fixture(scope="module")
def first(image) -> Stand:
    return Stand(UNO, image)


@pytest.fixture(scope="module")
def second(image):
    """The same stand, with the other controller in its socket."""
    with Avr8js(image) as avr:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(stands, "Avr", lambda *_, **__: avr)
            stand = Stand(UNO, image)
        yield stand
        assert avr.resets == 0  # the watchdog slept
        assert avr.overruns == 0


def coincidences() -> list[Flip]:
    """150 flips by chance, each with a twin soon after or in the very same cycle."""
    leaders, flips = list(TWINS), []
    for n, flip in enumerate(trials.train(len(leaders), 150, 2000)):
        gate = leaders[flip.gate]
        flips.append(flip._replace(gate=gate))
        flips.append(Flip(flip.cycle + LAGS[n % len(LAGS)], TWINS[gate], flip.blocked))
    return flips


def verified(stand: Stand, flips: list[Flip]) -> Recording:
    """Record, and compute the certificate's check from the events."""
    recording = stand.record(flips, flips[-1].cycle // 16_000 + 5)
    fire, crc = recording.certificate.fire_tick, 0
    for event in recording.events:
        crc = zlib.crc32(struct.pack("<IH", (event.tick + fire) % 2**32, event.state), crc)
    assert recording.certificate.crc32 == crc
    assert recording.certificate.events == len(recording.events)
    return recording


@pytest.mark.parametrize(
    ("flips", "count", "leeway"),
    [(trials.train(12, 300, 2000), 300, 0.3), (coincidences(), 250, 1)],
    ids=["apart", "coincident"],
)
def test_the_same_edges(first, second, flips, count, leeway):
    ours, theirs = verified(first, flips), verified(second, flips)
    assert len(ours.events) == count
    assert [event.state for event in theirs.events] == [event.state for event in ours.events]

    # An edge waits for the instruction, or the few with interrupts off, under which it comes; which
    # one that is depends on what was sent before. The constant must come out on the whole.
    apart = [b.tick - a.tick for a, b in zip(ours.events, theirs.events, strict=True)]
    assert sum(apart) / len(apart) == pytest.approx(ENTRY, abs=leeway)
    assert sum(abs(cycles - ENTRY) > 4 for cycles in apart) <= 0.03 * len(apart)
    assert max(abs(cycles - ENTRY) for cycles in apart) <= 8

    for name in ("gates", "initial_state", "overflows", "glitches", "late"):
        assert getattr(theirs.certificate, name) == getattr(ours.certificate, name)


def test_an_edge_at_every_cycle_around_the_counter_s_turn(second):
    stamps = trials.across_halves(second, 200)
    assert len(stamps) == 401
    assert max(abs(stamp.error - ENTRY) for stamp in stamps) <= 8


def outputs(stand: Stand) -> list[tuple[str, bool, int]]:
    """Drop with a release of 1 ms and a recording of 5 ms; what pins did, and when after FIRE."""
    armed = stand.ask(wire.Arm(wire.pack_label(1, 1), 0xFFF, 1, 1000, 200, 5), 100_000)
    stand.avr.take_changes()
    fired = stand.ask(wire.Fire(armed.token), 200_000)
    assert isinstance(fired, wire.Fired)
    stand.ask(wire.Abort())  # forget the drop, which has no events
    changes = [change for change in stand.avr.take_changes() if change.pin != UNO.led]
    return [(change.pin, change.high, change.cycle - changes[0].cycle) for change in changes]


def test_the_same_outputs(first, second):
    ours, theirs = outputs(first), outputs(second)
    release, sync = UNO.releases[0], UNO.sync
    for made in (ours, theirs):
        what = [(pin, high) for pin, high, _ in made]
        assert what == [(sync, True), (release, True), (release, False), (sync, False)]
        times = [cycle for _, _, cycle in made]
        assert times[1] == UNO.sync_lead
        assert times[2] - times[1] == 16_000  # the compare unit's work
        assert 0 <= times[3] - 80_000 < TURNS
