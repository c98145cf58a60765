"""The programmes of the Pico's PIO: what they do to the clock, in two models of the machine."""

import random

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link.client import Device
from rig_emulator.pico_board import USB_RATE, EmulatedPico
from rig_emulator.protocol_emu import EmulatedSerial
from rig_emulator.wiring import PICO
from tests.firmware.pico import build, programs
from tests.firmware.pio_model import Machine
from tests.link.bench import ScriptedLab
from tests.link.talk import record_drop

CAPTURE, RELEASE = (0, 5), (18, 26)
TICK = 6
STOP = 19
OPEN_TICKS = 6000
WHOLE = 0xFFFFFFFF
HZ = 120_000_000


@pytest.fixture(scope="module")
def words() -> list[int]:
    return programs()


def flips(count: int, gap: int) -> list[tuple[int, int, int]]:
    """Write (clock, gate, all gates after it) by chance, all gates clear in the end."""
    chance = random.Random(1)
    clock, gates, made = 500, 0, []
    for _ in range(count):
        clock += round(gap * chance.uniform(0.5, 1.5))
        gate = chance.randrange(16)
        gates ^= 1 << gate
        made.append((clock, gate, gates))
    for gate in range(16):
        if gates >> gate & 1:
            clock += gap
            gates ^= 1 << gate
            made.append((clock, gate, gates))
    return made


def captured(words, edges: list[tuple[int, int]], phase: int = 0) -> list[tuple[int, int]]:
    """Stamp (clock, all gates) edges: the (tick, gates) that the machine hands over."""
    machine = Machine(words, CAPTURE, clock=-phase)
    machine.run(edges[-1][0] + 100, dict(edges))
    pairs = zip(machine.rx[::2], machine.rx[1::2], strict=True)
    states = [states for states, _ in pairs]
    before = [0, *(now & 0xFFFF for now in states)]
    assert [state >> 16 for state in states] == before[:-1]  # what was, and what is
    return [
        (~count & WHOLE, now & 0xFFFF) for now, count in zip(states, machine.rx[1::2], strict=True)
    ]


@pytest.mark.parametrize("phase", range(TICK))
def test_every_edge_is_stamped_within_a_tick(words, phase):
    """Whenever in the loop it comes; a change takes three ticks and counts three."""
    edges = [(clock, gates) for clock, _, gates in flips(300, 60)]
    stamps = captured(words, edges, phase)
    assert [gates for _, gates in stamps] == [gates for _, gates in edges]
    errors = [tick * TICK - clock for (clock, _), (tick, _) in zip(edges, stamps, strict=True)]
    assert max(errors) - min(errors) < TICK


@pytest.mark.parametrize(("second", "least"), [(0b00, 0), (0b11, 1)])
def test_how_close_two_edges_may_be(words, second, least):
    """On one gate a pulse, on two gates: a tick apart there are two events, always."""
    for gap in range(1, 24):
        counts = {
            len(captured(words, [(60 + at, 0b01), (60 + at + gap, second)])) for at in range(TICK)
        }
        assert counts <= {least, 2}
        assert counts == {2} or gap < TICK
        assert 2 in counts  # no gap is so short that luck would not help


@pytest.mark.parametrize("ticks", [1, 2, 3, 1000])
@pytest.mark.parametrize("mask", [0b101, 0b110, 0b111, 0b100])
def test_a_pulse_is_as_long_as_ordered(words, ticks, mask):
    machine = Machine(words, RELEASE, jmp_pin=STOP)
    machine.run(100)
    machine.tx = [ticks - 1, OPEN_TICKS << 3 | mask]
    machine.run(200 + TICK * ticks)
    on = machine.moved[0]
    assert on[1] == mask  # all of them in one clock
    if mask != 0b100:
        assert machine.moved[1:] == [(on[0] + TICK * ticks, 0b100)]
    assert machine.rx == [WHOLE]
    assert machine.outputs == 0b100  # sync stays


def test_the_emergency_stop_ends_it_by_itself(words):
    machine = Machine(words, RELEASE, jmp_pin=STOP)
    machine.tx = [99_999, OPEN_TICKS << 3 | 0b111]
    spikes = {at: (1 << STOP) * (n % 2 == 0) for n, at in enumerate(range(1000, 72_000, 9000))}
    machine.run(75_000, spikes)
    assert machine.outputs == 0b111  # open for 9000 clocks is a spike
    opened = 75_001
    machine.run(120_000, {opened: 1 << STOP})
    (_, _), (off, left) = machine.moved
    assert left == 0b100
    assert 0 <= off - opened - OPEN_TICKS * TICK <= 3 * TICK
    on = machine.moved[0][0]
    assert (off - on) // TICK == 100_000 - machine.rx[0]  # what the board is told


def test_the_emulator_stamps_as_the_model_does(words):
    """All sixteen gates by chance: the same ticks, every one."""
    made = flips(60, 900)
    lab = ScriptedLab(changes=[(clock / HZ, gate, bool(g >> gate & 1)) for clock, gate, g in made])
    board = EmulatedPico(PICO, build(), lab, seed=1, baudrate=USB_RATE)
    port = EmulatedSerial("test", board=board, timeout=0.02, reset_on_open=False)
    device = Device(port, port.clock)
    device.connect()
    told = record_drop(device, gates=0xFFFF, release=0b11, pulse_us=1000, record_ms=5)
    port.close()
    assert told.faults == ()
    # Where in its loop the machine was at FIRE is one of six.
    edges = [(clock, gates) for clock, _, gates in made]
    agree = []
    for phase in range(TICK):
        stamps = captured(words, edges, phase)
        apart = {tick - edge.tick for (tick, _), edge in zip(stamps, told.edges, strict=True)}
        agree.append(len(apart) == 1)
    assert any(agree)
    assert not all(agree)  # the edges tell the phases apart
    fire = next(change.cycle for change in board.history if change.high)
    assert [(c.cycle - fire, c.pin, c.high) for c in board.history][:5] == [
        *((0, pin, True) for pin in (*PICO.releases, PICO.sync)),
        *((120_000, pin, False) for pin in PICO.releases),
    ]


def test_half_an_order_moves_nothing(words):
    """A program that hangs between its two words."""
    machine = Machine(words, RELEASE, jmp_pin=STOP)
    machine.tx = [1000]
    machine.run(50_000)
    assert machine.moved == []
