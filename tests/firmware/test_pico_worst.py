"""The Pico at its worst moments: a program that hangs, a host that does what no host should.

The emulator has no supply and no boot program: pulling the plug ends the power, and the pull-downs
of the outputs do the rest (firmware/README.md).
"""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig.link.frames import Decoder, Frame, encode
from rig_emulator.stand import Stand
from rig_emulator.wiring import PICO
from tests.firmware.pico import build, symbol

US = 120
MS = 1000 * US
HANG = (0xE7FE).to_bytes(2, "little")  # b .
WATCHDOG = 8


@pytest.fixture(scope="module")
def stand() -> Stand:
    return Stand(PICO, build())


@pytest.fixture(autouse=True)
def _rested(stand):
    """Let it rest from a pulse of 4 ms, and begin with its gates clear."""
    yield
    stand.hear(13 * MS)


def hang(stand: Stand) -> None:
    """Let the program stand still when the interrupt that wakes its loop comes next."""
    stand.avr.poke(symbol("timer_interrupt") & ~1, HANG)


def ends(stand: Stand) -> list[int]:
    """When both releases went off, in cycles since FIRE."""
    changes = [c for c in stand.avr.take_changes() if c.pin in PICO.releases]
    assert not any(c.high for c in changes)
    return [c.cycle - stand.fired for c in changes]


def test_a_program_that_hangs_ends_its_pulse_as_ordered_or_with_the_watchdog(stand):
    bitten = stand.avr.watchdog_resets
    for pulse_ms, ordered in ((40, True), (400, False)):
        stand.arm_and_fire(500, 1000 * pulse_ms)
        stand.hear(1 * MS)
        hang(stand)
        assert stand.hear(220 * MS) == [wire.Boot(WATCHDOG)]
        off, also = ends(stand)
        assert off == also <= 122 * MS
        assert (off == pulse_ms * MS) is ordered
    assert stand.avr.watchdog_resets == bitten + 2


def test_the_emergency_stop_ends_a_pulse_and_by_how_much_is_certified(stand):
    stand.arm_and_fire(60, 400_000)
    stand.hear(20 * MS)
    stand.avr.edge(opened := stand.avr.cycle, PICO.stop, True)
    certificate = stand.hear(80 * MS)[-1]
    off, also = ends(stand)
    assert off == also == pytest.approx(opened - stand.fired + 300 * US, abs=20)
    assert certificate.pulse_end == wire.PulseEnd.STOPPED
    assert certificate.pulse_ticks == off // 6
    assert certificate.supply_mv == pytest.approx(5000, abs=5)
    stand.ask(wire.Acknowledge(certificate.label, certificate.crc32))
    stand.avr.edge(0, PICO.stop, False)
    stand.hear(60 * MS)  # it rests three times as long as it was on


def test_the_emergency_stop_works_without_the_program(stand):
    stand.arm_and_fire(500, 100_000)
    stand.hear(1 * MS)
    hang(stand)
    stand.hear(1 * MS)
    stand.avr.edge(opened := stand.avr.cycle, PICO.stop, True)
    stand.hear(1 * MS)
    off, also = (end + stand.fired - opened for end in ends(stand))
    assert off == also == pytest.approx(300 * US, abs=20)
    stand.avr.edge(0, PICO.stop, False)
    stand.avr.reset()
    stand.hear(120 * MS)


DISTURBED = {
    "closed": lambda chip: chip.open(False),
    "unread": lambda chip: chip.reads(False),
    "bus reset": lambda chip: chip.reset_bus(),
    "flood": lambda chip: chip.receive(bytes(range(1, 256)) * 20),
}


@pytest.mark.parametrize("what", DISTURBED)
def test_nothing_on_usb_moves_a_pulse_or_loses_a_drop(stand, what):
    """Closed, unread, begun anew or flooded in the middle of it: the drop is there afterwards."""
    chip = stand.avr
    bitten = chip.watchdog_resets
    stand.arm_and_fire(10, 4_000)
    for n in range(200):
        chip.edge(stand.fired + US * (200 + 30 * n), "GP0", n % 2 == 0)
    stand.hear(1 * MS)
    DISTURBED[what](chip)
    chip.run(chip.cycle + 12 * MS)
    assert ends(stand) == [4 * MS] * 2
    chip.open()
    chip.reads(True)
    stand.hear(20 * MS)
    certificate = stand.ask(wire.Read(wire.pack_label(1, 1), 0, 0))
    assert (certificate.events, certificate.overflows) == (200, 0)
    assert certificate.pulse_end == wire.PulseEnd.ORDERED
    assert certificate.pulse_ticks == 80_000
    assert chip.watchdog_resets == bitten
    stand.ask(wire.Acknowledge(certificate.label, certificate.crc32))


def test_what_nobody_reads_disarms_no_later(stand):
    """Answers that fill the line keep no board armed; it says so when somebody reads again."""
    chip = stand.avr
    order = wire.Arm(wire.pack_label(1, 1), 1, 1, 4_000, 2, 5)
    stand.ask(order, 4000)
    chip.reads(False)
    code, payload = wire.pack(wire.Status())
    for seq in range(100, 160):
        chip.receive(encode(Frame(code, seq, 0, payload)))
    chip.run(chip.cycle + 3 * MS)
    assert chip.take_sent() == []
    assert chip.peek(symbol("phase"), 1) == bytes([wire.Phase.IDLE])
    chip.reads(True)
    chip.run(chip.cycle + 5 * MS)
    heard = Decoder().feed(b"\0" + bytes(one.value for one in chip.take_sent()))
    said = [wire.unpack(frame.type, frame.payload) for frame in heard]
    assert said.count(wire.Disarmed(order.label, wire.DisarmReason.TIMEOUT)) == 1
    assert said[-1].phase is wire.Phase.IDLE


def test_no_baud_rate_lets_it_go(stand):
    """Nothing on USB takes an armed board out of its program, not 1200 baud either."""
    order = wire.Arm(wire.pack_label(1, 1), 1, 1, 4_000, 100, 5)
    token = stand.ask(order, 4000).token
    stand.avr.rate(1200)
    stand.hear(5 * MS)
    assert isinstance(stand.ask(wire.Fire(token), 4000), wire.Fired)
