"""The emulator: simavr mended, against data sheets; emu:// and the pty with the real firmware."""

import json
import subprocess
import sys
from functools import partial

import pytest

import rig.boards
import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.errors import DeviceError, InputError
from rig.link import messages as wire
from rig.link.port import open_port
from rig_emulator.avr import Avr
from rig_emulator.controller import Stop
from rig_emulator.wiring import BOARDS, board_named, firmware_for
from tests.firmware.emulated import MCUS
from tests.firmware.pico import build
from tests.firmware.toolchain import FIRMWARE, make, need
from tests.link.talk import FENCE, connected, record_drop, url
from tests.programs import run_program
from tests.refusals import refused
from tests.tables import cases
from tests.waiting import PATIENCE_S

BYTE = 320  # cycles at 500 kbaud
ENTRY = {"atmega2560": 5, "atmega328p": 4}  # "Interrupt Response Time", then a jump of 3
OTHER = {"atmega2560": "PK", "atmega328p": "PD"}
LED = {"atmega2560": "PA0", "atmega328p": "PC0"}
each_mcu = pytest.mark.parametrize("mcu", MCUS)


STRICT = "-std=gnu11 -Wall -Wextra -Wshadow -Werror -Os -DF_CPU=16000000UL"


@pytest.fixture
def compiled(tmp_path):
    """Compile a program of the emulator's for a controller."""
    need("avr-gcc")

    def compile_for(source, mcu):
        words = *STRICT.split(), f"-mmcu={mcu}", FIRMWARE / "emulator" / source
        run_program("avr-gcc", *words, "-o", program := tmp_path / "program.elf")
        return program

    return compile_for


def stamping(program, mcu):
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


emu_url = partial(url, "emu")


@pytest.fixture(scope="module", autouse=True)
def _built():
    make("all")


def chains_fall(device):
    return record_drop(device, gates=0b11, pulse_us=80_000, record_ms=600)


@pytest.mark.parametrize(("board", "within"), [("mega", 5), ("uno", 5), ("pico", 1)])
def test_a_drop_is_the_truth_to_the_tick(tmp_path, board, within):
    """Edges come within an instruction of an AVR; the clock is as far off as its dial says."""
    if board == "pico":
        build()
    wiring, file = board_named(board), tmp_path / "truth.jsonl"
    port, device = connected(emu_url(board=board, seed=3, truth=file, clock="2000 ppm"))
    port.close()
    port.open()  # an AVR restarts; a Pico goes on, and says nothing of a start
    identity = device.connect()
    assert identity.gates == len(wiring.gates)
    drop = chains_fall(device)
    (line,) = (json.loads(text) for text in file.read_text("utf-8").splitlines())
    assert (drop.faults, drop.certificate.restarts) == ((), 0)
    edges = [(channel, blocked) for _, channel, blocked, _ in line["edges"]]
    assert [(edge.channel, edge.blocked) for edge in drop.edges] == edges
    assert len(edges) > 20
    for edge, (seconds, *_) in zip(drop.edges, line["edges"], strict=True):
        assert abs(edge.tick - seconds * identity.tick_hz * 1.002) <= within
    # What the outputs did: the release for as long as ordered, the sync for the whole recording.
    (on, off), (high, low) = (
        [change.cycle for change in port.board.history if change.pin == pin]
        for pin in (wiring.releases[0], wiring.sync)
    )
    assert on - high == wiring.sync_lead
    assert abs(off - on - 80e-3 * wiring.clock_hz) <= 1
    assert abs(low - high - 600e-3 * wiring.clock_hz) < 10e-3 * wiring.clock_hz
    assert port.board.avr.watchdog_resets == 0
    assert getattr(port.board.avr, "overruns", 0) == 0  # a Pico has no UART


@cases
def test_what_is_wrong_in_the_url_is_bad_input(settings, complaint):
    refused(InputError, complaint, open_port, emu_url(**settings))


@pytest.mark.parametrize("word", rig.boards.BOARDS)
def test_the_table_of_boards_says_what_the_firmware_says(word):
    _, device = connected(emu_url(board=word))
    assert device.transcript.identity.capabilities() == rig.boards.BOARDS[word]


def test_every_board_of_the_table_can_be_emulated():
    assert rig.boards.BOARDS.keys() == BOARDS.keys() | {"pico"}


def test_without_a_build_there_is_the_shipped_firmware(monkeypatch, tmp_path):
    package = tmp_path / "rig"
    (package / "flash").mkdir(parents=True)
    monkeypatch.setattr("rig_emulator.wiring.rig.__file__", str(package / "__init__.py"))
    error = refused(InputError, "no firmware for atmega2560", firmware_for, BOARDS["mega"])
    assert "make -C firmware" in error.hint
    shipped = package / "flash" / "atmega2560.hex"
    shipped.touch()
    assert firmware_for(BOARDS["mega"]) == shipped


HANDS = [sys.executable, "-m", "rig_emulator.hands"]


def test_the_pty_is_a_board_to_any_program(tmp_path):
    link = tmp_path / "board"
    command = [*HANDS, "--link", str(link), "--protocol", str(FENCE), "quiet=1"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as terminal:
        assert terminal.stdout.readline().strip() == str(link)
        port, device = connected(str(link), boot_wait_s=0)
        identity = device.transcript.identity
        assert len(chains_fall(device).edges) > 20
        port.close()
        port, device = connected(str(link.readlink()), boot_wait_s=0)
        assert device.transcript.identity == identity
        terminal.stdin.write("reset\n")
        terminal.stdin.flush()
        refused(DeviceError, "restarted", device.collect, wire.pack_label(1, 1), timeout=10.0)
        port.close()
        terminal.stdin.close()
        assert terminal.wait(PATIENCE_S) == 0
    assert not link.is_symlink()
