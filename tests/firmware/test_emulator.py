"""simavr with its defects mended, against what the data sheets say of the silicon."""

from pathlib import Path

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig_emulator.avr import Avr
from rig_emulator.controller import Stop
from tests.firmware.emulated import MCUS
from tests.tables import cases

BYTE = 320  # cycles at 500 kbaud
ENTRY = {"atmega2560": 5, "atmega328p": 4}  # "Interrupt Response Time", then a jump of 3
OTHER = {"atmega2560": "PK", "atmega328p": "PD"}
LED = {"atmega2560": "PA0", "atmega328p": "PC0"}
each_mcu = pytest.mark.parametrize("mcu", MCUS)


def stamping(program: Path, mcu: str) -> tuple[Avr, int]:
    """Start stamps.c with all gates low; also the cycle at which its timer was 0."""
    avr = Avr(program, mcu)
    for pin in range(8):
        avr.edge(0, f"PB{pin}", False)
        avr.edge(0, f"{OTHER[mcu]}{pin}", False)
    avr.run(3000)
    (rise,) = avr.take_changes()
    assert rise.pin == LED[mcu]
    return avr, rise.cycle + 1 - avr.number("zero")


# -- interrupts and pins


@each_mcu
@pytest.mark.parametrize("name", ["b", "other"])
def test_an_interrupt_starts_as_late_as_on_silicon(compiled, mcu, name):
    avr, zero = stamping(compiled("tests/stamps.c", mcu), mcu)
    port = "PB" if name == "b" else OTHER[mcu]
    delays = []
    for n in range(64):
        at = 5000 + 101 * n
        avr.edge(at, f"{port}{n % 8}", n // 8 % 2 == 0)
        avr.run(at + 80)
        delays.append((avr.number(f"stamp_{name}") - (at - zero)) & 0xFFFF)
        assert avr.number(f"count_{name}") == n + 1
    # The loop's only instruction takes two cycles: half the edges find it in its middle.
    first = ENTRY[mcu] + 3
    assert delays in ([first, first + 1] * 32, [first + 1, first] * 32)


@each_mcu
def test_a_pulse_within_one_instruction_is_still_an_interrupt(compiled, mcu):
    avr, _ = stamping(compiled("tests/stamps.c", mcu), mcu)
    avr.edge(4000, "PB3", True)
    avr.edge(4001, "PB3", False)
    avr.run(4100)
    assert (avr.number("count_b"), avr.number("level_b")) == (1, 0)


# -- the UART


@each_mcu
def test_a_byte_takes_ten_bits(compiled, mcu):
    avr = Avr(compiled("tests/talk.c", mcu), mcu)
    avr.run(5000)
    avr.receive(b"A", 6000)
    assert avr.run(10_000, stop_on_sent=True) is Stop.SENT
    assert 6000 + BYTE <= avr.cycle < 6000 + BYTE + 30  # the poll, and the way to UDR0
    (sent,) = avr.take_sent()
    assert sent.value == ord("B")
    assert avr.cycle - 3 < sent.cycle - BYTE <= avr.cycle  # UDR0's write begins the start bit


# -- timers


@cases
def test_input_capture_takes_the_very_cycle(compiled, mcu, index, pin):
    avr = Avr(compiled("tests/capture.c", mcu), mcu)
    avr.edge(0, pin, False)
    avr.run(2000)
    (rise,) = avr.take_changes()
    offsets = set()
    for n in range(40):
        at = 3000 + 9001 * n  # over several overflows
        avr.edge(at, pin, True)
        avr.edge(at + 300, pin, False)
        avr.run(at + 500)
        captured = int.from_bytes(avr.peek("captured")[2 * index : 2 * index + 2], "little")
        offsets.add((captured - (at - rise.cycle)) & 0xFFFF)
        assert avr.peek("count")[index] == n + 1
    # The output rises an instruction after timers 1 and 5 start, and one before timer 4 does.
    assert offsets == ({0xFFFF} if pin == "PL0" else {2})


# -- resets, memory, faults


@each_mcu
def test_the_watchdog_bites(compiled, mcu):
    avr = Avr(compiled("tests/restart.c", mcu), mcu)
    avr.run(1_000_000)
    assert (avr.number("boots"), avr.watchdog_resets) == (1, 0)
    avr.take_changes()
    avr.poke("hang", b"\1")
    avr.run(1_400_000)
    assert (avr.number("boots"), avr.watchdog_resets) == (2, 1)
    assert avr.peek("causes")[:2] == bytes([1, 8])
    fall, rise = avr.take_changes()
    assert abs(fall.cycle - (1_000_000 + 256_000)) < 50  # 16 ms after the last kick
    assert 0 < rise.cycle - fall.cycle < 1000
    avr.run(2_000_000)  # kicked again
    assert avr.watchdog_resets == 1
