"""simavr with its defects mended, against what the data sheets say of the silicon."""

from __future__ import annotations

import random
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.errors import InputError
from rig_emulator.avr import FILL, Avr
from rig_emulator.controller import EmulatorError, Stop
from rig_emulator.image import Image, read_image
from tests.firmware.conftest import STRICT
from tests.firmware.emulated import EMULATOR, MCUS
from tests.firmware.toolchain import need

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
def test_writing_a_port_does_not_move_its_inputs(compiled, mcu):
    avr, _ = stamping(compiled("tests/stamps.c", mcu), mcu)
    assert (avr.number("count_b"), avr.number("count_other")) == (0, 0)
    avr.edge(4000, "PB1", True)
    avr.run(4100)
    assert (avr.number("count_b"), avr.number("level_b")) == (1, 0b10)


@each_mcu
def test_a_pulse_within_one_instruction_is_still_an_interrupt(compiled, mcu):
    avr, _ = stamping(compiled("tests/stamps.c", mcu), mcu)
    avr.edge(4000, "PB3", True)
    avr.edge(4001, "PB3", False)
    avr.run(4100)
    assert (avr.number("count_b"), avr.number("level_b")) == (1, 0)


@each_mcu
def test_edges_that_were_taken_back_do_not_come(compiled, mcu):
    avr, _ = stamping(compiled("tests/stamps.c", mcu), mcu)
    for at in (4000, 4200):
        avr.edge(at, "PB3", at == 4000)
        avr.edge(at, "PB4", at == 4000)
    avr.run(4100)
    avr.clear_edges("PB3")
    assert avr.edges_left == 1
    avr.run(4300)
    assert avr.number("count_b") == 2
    assert avr.number("level_b") == 0b1000


@each_mcu
def test_the_log_does_not_depend_on_how_the_time_is_cut(compiled, mcu):
    def work(slices) -> tuple:
        avr = Avr(compiled("tests/stamps.c", mcu), mcu)
        rng = random.Random(5)
        for _ in range(300):
            port = rng.choice(["PB", OTHER[mcu]])
            avr.edge(rng.randrange(60_000), f"{port}{rng.randrange(8)}", rng.random() < 0.5)
        until = 0
        while until < 70_000:
            until = min(70_000, until + slices(rng))
            avr.run(until)
        return avr.cycle, avr.peek(0x100, 0x700), avr.take_changes()

    whole = work(lambda rng: 70_000)
    assert whole == work(lambda rng: 1)
    assert whole == work(lambda rng: 997)
    assert whole == work(lambda rng: rng.randrange(1, 40))


@each_mcu
def test_a_watched_output_ends_a_run_at_once(compiled, mcu):
    avr = Avr(compiled("tests/stamps.c", mcu), mcu)
    avr.watch(LED[mcu])
    assert avr.run(3000) is Stop.PIN
    (rise,) = avr.take_changes()
    assert rise == (rise.cycle, LED[mcu], True)
    assert avr.cycle == rise.cycle + 1  # one OUT
    assert avr.output(LED[mcu])
    assert avr.run(3000) is Stop.REACHED
    assert 3000 <= avr.cycle < 3010


@each_mcu
def test_an_input_held_low_costs_no_time(compiled, mcu):
    avr = Avr(compiled("tests/talk.c", mcu), mcu)
    for _ in range(2):
        for n in range(6):
            avr.edge(avr.cycle + 100 + n, "PD2", n % 2 == 0)
            avr.edge(avr.cycle + 200 + n, "PD3", n % 2 == 0)
        avr.run(avr.cycle + 5000)
        assert avr.timers == 0
        avr.reset()  # simavr's own reset would have each level looked at in every cycle


def test_pins_that_are_not_there(compiled):
    avr = Avr(compiled("tests/talk.c", "atmega328p"), "atmega328p")
    for pin in ("PA0", "PB8", "B1", "", "PM0"):
        with pytest.raises(ValueError, match="no pin"):
            avr.edge(0, pin, True)


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


@each_mcu
def test_the_transmitter_never_pauses(compiled, mcu):
    avr = Avr(compiled("tests/talk.c", mcu), mcu)
    avr.run(5000)
    avr.receive(b"t", 6000)
    avr.run(20_000)
    sent = avr.take_sent()
    assert bytes(s.value for s in sent) == b"abcdefghijklmnopqrst"
    assert {b.cycle - a.cycle for a, b in pairwise(sent)} == {BYTE}


@each_mcu
def test_what_is_not_fetched_in_time_is_lost_and_counted(compiled, mcu):
    avr = Avr(compiled("tests/talk.c", mcu), mcu)
    avr.run(5000)
    avr.receive(b"w01234567890")
    avr.run(30_000)
    # Deaf for 2000 cycles: three wait, and four begin while there is no room.
    assert avr.overruns == 4
    assert bytes(s.value for s in avr.take_sent()) == b"123" + b"89:1"


@each_mcu
def test_interrupts_both_ways(compiled, mcu):
    avr = Avr(compiled("tests/talk_isr.c", mcu), mcu)
    avr.run(5000)
    avr.receive(bytes(range(20)))
    avr.run(30_000)
    sent = avr.take_sent()
    assert bytes(s.value for s in sent) == bytes(range(1, 21))
    assert {b.cycle - a.cycle for a, b in pairwise(sent)} == {BYTE}
    assert avr.overruns == 0


@each_mcu
def test_a_wrong_baud_rate_is_not_understood(compiled, mcu):
    avr = Avr(compiled("tests/talk.c", mcu, "-DUBRR=4"), mcu)
    avr.run(5000)
    avr.receive(b"A")
    avr.run(10_000)
    (sent,) = avr.take_sent()
    assert sent.value != ord("B")


# -- timers


@pytest.mark.parametrize(
    ("mcu", "index", "pin"),
    [("atmega2560", 0, "PL0"), ("atmega2560", 1, "PL1"), ("atmega328p", 0, "PB0")],
)
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


@each_mcu
@pytest.mark.parametrize("how", [1, 2])
def test_only_the_flag_that_was_meant_is_cleared(compiled, mcu, how):
    avr = Avr(compiled("tests/capture.c", mcu), mcu)
    avr.run(140_000)  # past two overflows, and all compare units have matched
    avr.poke("clear", bytes([how]))
    avr.run(141_000)
    before, after = avr.number("flags_before"), avr.number("flags_after")
    assert before & 0b1111 == 0b1111 if mcu == "atmega2560" else before & 0b111 == 0b111
    assert after == before & ~1


# -- resets, memory, faults


@each_mcu
def test_a_reset_keeps_ram_and_eeprom(compiled, mcu):
    avr = Avr(compiled("tests/restart.c", mcu), mcu)
    avr.eeprom_write(5, b"\x42")
    avr.run(100_000)
    assert (avr.number("boots"), avr.peek("causes")[0]) == (1, 1)
    assert (avr.number("stored"), avr.number("cleared")) == (0x42, 0)
    assert avr.eeprom_read(5, 3) == b"\x42\x01\xff"
    avr.take_changes()
    avr.reset()
    (fall,) = avr.take_changes()  # a pin lets go when reset is pulled
    assert (fall.pin, fall.high) == (LED[mcu], False)
    avr.run(200_000)
    assert (avr.number("boots"), avr.peek("causes")[:2]) == (2, bytes([1, 2]))
    assert avr.eeprom_read(5, 2) == b"\x42\x02"
    assert avr.watchdog_resets == 0


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


@each_mcu
def test_levels_outside_survive_a_reset(compiled, mcu):
    avr, _ = stamping(compiled("tests/stamps.c", mcu), mcu)
    avr.edge(4000, "PB2", True)
    avr.run(5000)
    avr.reset()
    avr.edge(9000, "PB5", True)
    avr.run(10_000)
    assert (avr.number("count_b"), avr.number("level_b")) == (1, 0b100100)


@each_mcu
@pytest.mark.parametrize(("how", "what"), [(2, "sleeps"), (3, "Invalid write address")])
def test_a_crash_is_an_error_until_the_next_reset(compiled, mcu, how, what):
    avr = Avr(compiled("tests/restart.c", mcu), mcu)
    avr.run(100_000)
    avr.poke("hang", bytes([how]))
    for _ in range(2):
        with pytest.raises(EmulatorError, match=what) as caught:
            avr.run(200_000)
    assert "\x1b" not in str(caught.value)
    avr.reset()
    avr.run(300_000)
    assert avr.number("boots") == 2


@each_mcu
def test_the_stack_leaves_a_mark(compiled, mcu):
    avr = Avr(compiled("tests/talk_isr.c", mcu), mcu)
    start = avr.symbols["_end"].address
    room = len(avr.peek(start, 0x900 - start if mcu == "atmega328p" else 0x2200 - start))
    assert avr.stack_free() == room
    avr.run(5000)
    idle = room - avr.stack_free()
    avr.receive(b"abc")
    avr.run(9000)
    busy = room - avr.stack_free()
    assert 0 < idle < busy < 60
    avr.poke(start + 100, bytes([FILL ^ 1]))
    assert avr.stack_free() == 100


def test_memory_has_an_end(compiled):
    avr = Avr(compiled("tests/restart.c", "atmega328p"), "atmega328p")
    for bad in (
        lambda: avr.peek(0x8FF, 2),
        lambda: avr.poke(0x900, b"1"),
        lambda: avr.poke("hang", b"12"),
        lambda: avr.eeprom_read(1023, 2),
        lambda: avr.eeprom_write(1024, b"1"),
        lambda: avr.number("nonsense"),
        lambda: avr.number("main"),
    ):
        with pytest.raises(ValueError, match=r"beyond|has 1 bytes|no variable"):
            bad()


# -- programs


def test_hex_and_elf_are_the_same_program(compiled, tmp_path):
    elf = compiled("tests/restart.c", "atmega2560")
    hexed = tmp_path / "it.hex"
    subprocess.run(["avr-objcopy", "-O", "ihex", "-R", ".eeprom", elf, hexed], check=True)

    def flash(path: Path) -> dict[int, int]:
        return {at + n: byte for at, data in read_image(path).flash for n, byte in enumerate(data)}

    assert flash(hexed) == flash(elf)
    avr = Avr(hexed, "atmega2560")
    avr.run(1000)
    assert [change.pin for change in avr.take_changes()] == ["PA0"]
    with pytest.raises(ValueError, match="without symbols"):
        avr.stack_free()
    text = hexed.read_text()
    for damaged in (text.replace("0C94", "0C95", 1), text[: len(text) // 2], "", ":zz"):
        hexed.write_text(damaged)
        with pytest.raises(InputError, match="is no AVR firmware"):
            read_image(hexed)


def test_what_is_no_program(tmp_path, compiled):
    with pytest.raises(InputError, match="another machine"):
        read_image(Path(sys.executable))
    with pytest.raises(InputError, match="cannot read"):
        read_image(tmp_path / "nothing.elf")
    program = compiled("tests/talk.c", "atmega328p")
    with pytest.raises(InputError, match="knows no controller"):
        Avr(program, "atmega9999")
    with pytest.raises(InputError, match="too large"):
        Avr(Image([(32768, b"12")]), "atmega328p")


def test_the_harness_compiles_without_a_warning():
    need("gcc")
    command = ["gcc", *STRICT, "-Wconversion", "-O2", "-fsyntax-only", "-isystem"]
    sources = sorted((EMULATOR / "rig_emulator").glob("*.c"))
    assert sources
    subprocess.run([*command, "/usr/include/simavr", *map(str, sources)], check=True)


# -- the rivals of the benchmark


@each_mcu
@pytest.mark.parametrize(
    ("program", "flags", "within_us"),
    [("micros_isr", (), 12), ("polling", ("-DPRINT_LATER",), 20)],
)
def test_the_rivals_time_a_slow_drop(compiled, mcu, program, flags, within_us):
    avr = Avr(compiled(f"rivals/{program}.c", mcu, *flags), mcu)
    release, gates = ("PE3", ["PB0", "PK3"]) if mcu == "atmega2560" else ("PB1", ["PD2", "PC5"])
    for pin in gates:
        avr.edge(0, pin, False)
    avr.watch(release)
    avr.receive(b"!", 100_000)  # RAM is being cleared until about 30,000
    assert avr.run(1_000_000) is Stop.PIN
    fired = avr.take_changes()[0].cycle
    edges = [fired + 16_000 + 40_000 * n + 13 * n * n for n in range(20)]
    for n, at in enumerate(edges):
        avr.edge(at, gates[n // 2 % 2], n % 2 == 0)
    avr.run(fired + 20_000_000)
    assert avr.number("printed") == 1
    assert avr.number("count") == len(edges)
    times = avr.peek("times")
    start = avr.number("fired")
    for n, at in enumerate(edges):
        us = int.from_bytes(times[4 * n : 4 * n + 4], "little") - start
        assert abs(us - (at - fired) / 16) <= within_us
