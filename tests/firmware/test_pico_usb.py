"""The Pico's USB on bad days: a host that loses, gives up, sleeps; a controller that hangs."""

from itertools import product

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig_emulator.pico_chip import PicoChip
from rig_emulator.stand import Flip, Stand
from rig_emulator.usb_bench import soak
from rig_emulator.wiring import PICO
from tests.firmware.pico import build

MS = PICO.clock_hz // 1000


@pytest.fixture
def stand():
    return Stand(PICO, build())


def flips(count=400, spacing=MS // 40):
    return [Flip(MS + n * spacing, n // 2 % 16, n % 2 == 0) for n in range(count)]


def test_it_is_back_after_every_hang_with_the_drop_that_it_held():
    """Ten here; a thousand: ./run bench usb."""
    build()
    seen = soak(10)
    assert list(seen.values())[:4] == [10, 10, 0, 0]
    assert seen["ms to come back, longest"] < 500


def test_a_drop_goes_on_while_the_controller_hangs(stand):
    made = flips()
    fire, changes = stand.arm_and_fire(300, 100_000)
    for flip in made:
        stand.avr.edge(fire + flip.cycle, PICO.gates[flip.gate], flip.blocked)
    stand.hear(3 * MS)
    stand.avr.hang_usb()
    stand.hear(400 * MS)
    state = stand.ask(wire.Status())
    assert (state.phase, state.events) == (wire.Phase.HOLDING, len(made))
    changes += stand.avr.take_changes()
    on, off = (c.cycle for c in changes if c.pin == PICO.releases[0])
    assert off - on == 100 * MS


@pytest.mark.parametrize("hostile", [{"loses": 3}, {"gives_up": 3}, {"loses": 4, "gives_up": 5}])
def test_what_the_host_loses_or_gives_up_changes_nothing(stand, hostile):
    """It would find a packet of the wrong PID, or one of a request that it has given up."""
    chip = stand.avr
    chip.hostile(**hostile)
    chip.reset_bus()
    stand.hear(50 * MS)
    assert chip.usb["ready"]
    for baud in (9600, 115_200, 500_000):
        chip.rate(baud)
        stand.hear(2 * MS)
    recording = stand.record(made := flips(), 30)
    assert len(recording.stamps(made)) == len(made)
    name = stand.identity.unique_id.hex().upper()
    assert chip.texts == ["chainrig", "chainrig on a Pico", name]
    assert (chip.usb["lost"] > 10) == ("loses" in hostile)
    assert (chip.usb["gaveUp"] > 1) == ("gives_up" in hostile)
    assert chip.usb["late"] == 0


def test_both_sides_count_packets_from_the_beginning(stand):
    for pings, clear in product((1, 2), (stand.avr.clear_halts, stand.avr.set_interface)):
        clear()
        stand.hear(2 * MS)
        for _ in range(pings):  # an odd and an even number of packets before
            stand.ask(wire.Ping())
        stand.avr.reads(False)  # and then one that waits to be taken
        stand.send(wire.Status())
        stand.hear(MS)
        clear()
        stand.hear(2 * MS)
        stand.avr.reads(True)
        assert [type(message) for message in stand.hear(MS)] == [wire.State]
        for _ in range(3):
            assert isinstance(stand.ask(wire.Ping()), wire.Pong)


def test_neither_a_bus_that_sleeps_nor_a_controller_that_is_dead_stops_the_board(stand):
    stand.avr.sleep_bus(True)
    stand.hear(200 * MS)
    stand.avr.sleep_bus(False)
    stand.hear(20 * MS)
    assert stand.avr.usb["plugs"] == 1
    assert isinstance(stand.ask(wire.Ping()), wire.Pong)
    stand.avr.hang_usb()  # and it is watched again
    stand.hear(300 * MS)
    assert stand.avr.usb["plugs"] == 2
    stand.avr.hang_usb(dead_s=1.0)  # a controller that stays dead does not stop the board
    stand.hear(900 * MS)
    assert (stand.avr.usb["ready"], stand.avr.watchdog_resets) == (0, 0)
    stand.hear(400 * MS)
    assert stand.avr.usb["ready"]
    assert isinstance(stand.ask(wire.Ping()), wire.Pong)


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


def test_it_goes_over_to_take_firmware_from_idle_only(stand):
    def refused(detail=0):
        answer = stand.ask(wire.Flash())
        assert isinstance(answer, wire.Refused)
        stand.hear(5 * MS)
        assert (stand.avr.usb["boots"], answer.detail) == (0, detail)
        return answer.reason

    label = wire.pack_label(1, 1)
    assert isinstance(stand.ask(wire.Arm(label, 1, 0, 0, 200, 20)), wire.Armed)
    assert refused() is wire.RefusalReason.BUSY
    stand.ask(wire.Abort())
    stand.arm_and_fire(200, 10_000)
    stand.hear(MS)
    assert refused() is wire.RefusalReason.BUSY
    certificate = stand.hear(200 * MS)[-1]
    assert refused(detail=1) is wire.RefusalReason.HOLDING_A_DROP
    stand.ask(wire.Acknowledge(label, certificate.crc32))
    stand.avr.reads(False)  # it waits for its answer to be taken, and meanwhile goes on
    stand.send(wire.Flash())
    stand.hear(5 * MS)
    assert stand.avr.usb["boots"] == 0
    stand.avr.reads(True)
    assert stand.hear(5 * MS) == [wire.Done()]
    assert stand.avr.usb["boots"] == 1
    assert not any(map(stand.avr.output, (*PICO.releases, PICO.sync)))
