"""The Pico's real binary: its ring of stamps, its worst moments, and its USB on bad days.

The emulator has no supply and no boot program: pulling the plug ends the power, and the pull-downs
of the outputs do the rest (firmware/README.md).
"""

from itertools import pairwise, product

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig.link.frames import Decoder
from rig_emulator.pico_chip import PicoChip
from rig_emulator.stand import Flip, Stand
from rig_emulator.usb_bench import soak
from rig_emulator.wiring import PICO
from tests.firmware.pico import build, symbol
from tests.link.talk import framed

US = 120
MS = 1000 * US


@pytest.fixture(scope="module")
def stand() -> Stand:
    return Stand(PICO, build())


@pytest.fixture(autouse=True)
def _rested(stand):
    """Let it rest from a pulse of 4 ms, and begin with its gates clear."""
    yield
    stand.hear(13 * MS)


@pytest.fixture
def fresh() -> Stand:
    return Stand(PICO, build())


# -- DMA hands over a whole drop at the fastest rate there is, or it is said


RODS, GATES = 100, 16
CLOCKS = 18  # from one stamp to the next
GATES_MACHINE = 0


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


# -- a program that hangs, a host that does what no host should


HANG = (0xE7FE).to_bytes(2, "little")  # b .
WATCHDOG = 8


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


@pytest.mark.parametrize("deed", ["open", "reads", "reset_bus", "receive"])
def test_nothing_on_usb_moves_a_pulse_or_loses_a_drop(stand, deed):
    """Closed, unread, begun anew or flooded in the middle of it: the drop is there afterwards."""
    chip = stand.avr
    bitten = chip.watchdog_resets
    stand.arm_and_fire(10, 4_000)
    for n in range(200):
        chip.edge(stand.fired + US * (200 + 30 * n), "GP0", n % 2 == 0)
    stand.hear(1 * MS)
    values = {"receive": [bytes(range(1, 256)) * 20], "reset_bus": []}
    getattr(chip, deed)(*values.get(deed, [False]))
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
    for seq in range(100, 160):
        chip.receive(framed(wire.Status(), seq))
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


# -- a host that loses, gives up, sleeps; a controller that hangs


def flips(count=400, spacing=MS // 40):
    return [Flip(MS + n * spacing, n // 2 % 16, n % 2 == 0) for n in range(count)]


def test_it_is_back_after_every_hang_with_the_drop_that_it_held():
    """Ten here; a thousand: ./run bench usb."""
    build()
    seen = soak(10)
    assert list(seen.values())[:4] == [10, 10, 0, 0]
    assert seen["ms to come back, longest"] < 500


def test_a_drop_goes_on_while_the_controller_hangs(fresh):
    made = flips()
    fire, changes = fresh.arm_and_fire(300, 100_000)
    for flip in made:
        fresh.avr.edge(fire + flip.cycle, PICO.gates[flip.gate], flip.blocked)
    fresh.hear(3 * MS)
    fresh.avr.hang_usb()
    fresh.hear(400 * MS)
    state = fresh.ask(wire.Status())
    assert (state.phase, state.events) == (wire.Phase.HOLDING, len(made))
    changes += fresh.avr.take_changes()
    on, off = (c.cycle for c in changes if c.pin == PICO.releases[0])
    assert off - on == 100 * MS


@pytest.mark.parametrize("hostile", [{"loses": 3}, {"gives_up": 3}, {"loses": 4, "gives_up": 5}])
def test_what_the_host_loses_or_gives_up_changes_nothing(fresh, hostile):
    """It would find a packet of the wrong PID, or one of a request that it has given up."""
    chip = fresh.avr
    chip.hostile(**hostile)
    chip.reset_bus()
    fresh.hear(50 * MS)
    assert chip.usb["ready"]
    for baud in (9600, 115_200, 500_000):
        chip.rate(baud)
        fresh.hear(2 * MS)
    recording = fresh.record(made := flips(), 30)
    assert len(recording.stamps(made)) == len(made)
    name = fresh.identity.unique_id.hex().upper()
    assert chip.texts == ["chainrig", "chainrig on a Pico", name]
    assert (chip.usb["lost"] > 10) == ("loses" in hostile)
    assert (chip.usb["gaveUp"] > 1) == ("gives_up" in hostile)
    assert chip.usb["late"] == 0


def test_both_sides_count_packets_from_the_beginning(fresh):
    for pings, clear in product((1, 2), (fresh.avr.clear_halts, fresh.avr.set_interface)):
        clear()
        fresh.hear(2 * MS)
        for _ in range(pings):  # an odd and an even number of packets before
            fresh.ask(wire.Ping())
        fresh.avr.reads(False)  # and then one that waits to be taken
        fresh.send(wire.Status())
        fresh.hear(MS)
        clear()
        fresh.hear(2 * MS)
        fresh.avr.reads(True)
        assert [type(message) for message in fresh.hear(MS)] == [wire.State]
        for _ in range(3):
            assert isinstance(fresh.ask(wire.Ping()), wire.Pong)


def test_neither_a_bus_that_sleeps_nor_a_controller_that_is_dead_stops_the_board(fresh):
    fresh.avr.sleep_bus(True)
    fresh.hear(200 * MS)
    fresh.avr.sleep_bus(False)
    fresh.hear(20 * MS)
    assert fresh.avr.usb["plugs"] == 1
    assert isinstance(fresh.ask(wire.Ping()), wire.Pong)
    fresh.avr.hang_usb()  # and it is watched again
    fresh.hear(300 * MS)
    assert fresh.avr.usb["plugs"] == 2
    fresh.avr.hang_usb(dead_s=1.0)  # a controller that stays dead does not stop the board
    fresh.hear(900 * MS)
    assert (fresh.avr.usb["ready"], fresh.avr.watchdog_resets) == (0, 0)
    fresh.hear(400 * MS)
    assert fresh.avr.usb["ready"]
    assert isinstance(fresh.ask(wire.Ping()), wire.Pong)


@pytest.mark.parametrize(
    ("revision", "product"), [(1, "chainrig on a Pico B1 (use no hub)"), (2, "chainrig on a Pico")]
)
def test_an_old_chip_that_a_hub_hides_says_so(revision, product):
    """RP2040-E5: B0 and B1 miss the end of a bus reset while the hub is busy."""
    chip = PicoChip(build(), bytes(8), revision=revision)

    def lamp():
        levels = set()
        for _ in range(20):
            chip.run(chip.cycle + 20 * MS)
            levels.add(chip.output("GP25"))
        return levels

    chip.busy_hub(True)
    assert lamp() == ({False, True} if revision == 1 else {False})
    chip.busy_hub(False)  # and now it is plugged straight into the computer
    chip.reset_bus()
    chip.run(chip.cycle + 50 * MS)
    assert lamp() == {False}
    assert chip.texts[1] == product
    for sleeps in (True, False):
        chip.sleep_bus(sleeps)
        assert lamp() == {False}
    chip.open()
    chip.run(chip.cycle + 10 * MS)
    assert chip.usb["ready"]


def test_it_goes_over_to_take_firmware_from_idle_only(fresh):
    def refused(detail=0):
        answer = fresh.ask(wire.Flash())
        assert isinstance(answer, wire.Refused)
        fresh.hear(5 * MS)
        assert (fresh.avr.usb["boots"], answer.detail) == (0, detail)
        return answer.reason

    label = wire.pack_label(1, 1)
    assert isinstance(fresh.ask(wire.Arm(label, 1, 0, 0, 200, 20)), wire.Armed)
    assert refused() is wire.RefusalReason.BUSY
    fresh.ask(wire.Abort())
    fresh.arm_and_fire(200, 10_000)
    fresh.hear(MS)
    assert refused() is wire.RefusalReason.BUSY
    certificate = fresh.hear(200 * MS)[-1]
    assert refused(detail=1) is wire.RefusalReason.HOLDING_A_DROP
    fresh.ask(wire.Acknowledge(label, certificate.crc32))
    fresh.avr.reads(False)  # it waits for its answer to be taken, and meanwhile goes on
    fresh.send(wire.Flash())
    fresh.hear(5 * MS)
    assert fresh.avr.usb["boots"] == 0
    fresh.avr.reads(True)
    assert fresh.hear(5 * MS) == [wire.Done()]
    assert fresh.avr.usb["boots"] == 1
    assert not any(map(fresh.avr.output, (*PICO.releases, PICO.sync)))
