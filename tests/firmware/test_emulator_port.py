"""``emu://`` and the pty, with the real firmware behind them."""

import json
import subprocess
import sys
from pathlib import Path
from urllib.parse import quote

import pytest

import rig.boards
import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.errors import DeviceError, InputError
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.messages import pack_label
from rig.link.port import open_port, port_clock
from rig_emulator.wiring import BOARDS, firmware_for
from tests.firmware.toolchain import make
from tests.tables import cases
from tests.waiting import PATIENCE_S

PROTOCOLS = Path(__file__).parents[2] / "protocols"
FENCE = PROTOCOLS / "picket-fence.yaml"
HZ = 16_000_000
ORDER = {"release": 1, "pulse_us": 80_000, "timeout_ms": 5000}


@pytest.fixture(scope="module", autouse=True)
def _built():
    make("all")


def url(protocol: Path = FENCE, **settings: object) -> str:
    said = {"protocol": str(protocol), **settings}
    return "emu://?" + "&".join(f"{name}={quote(str(value))}" for name, value in said.items())


def drop_from(device: Device, gates: int = 0b11, record_ms: int = 600):
    label = pack_label(1, 1)
    device.fire(device.arm(wire.Arm(label=label, gates=gates, record_ms=record_ms, **ORDER)))
    drop = device.collect(label)
    device.acknowledge(label, drop.certificate.crc32)
    return drop


def talk(where: str):
    """Have one drop: all bytes with their times, the drop, the device's identity, its port."""
    port = open_port(where)
    chunks: list[tuple] = []
    device = Device(port, port_clock(port), lambda *chunk: chunks.append(chunk))
    identity = device.connect()
    return chunks, drop_from(device), identity, port


@pytest.mark.parametrize("board", sorted(BOARDS))
def test_a_drop_is_the_truth_to_the_cycle(tmp_path, board):
    file = tmp_path / "truth.jsonl"
    _, drop, identity, port = talk(url(board=board, seed=3, truth=file, clock="2000 ppm"))
    (line,) = (json.loads(text) for text in file.read_text("utf-8").splitlines())
    assert drop.faults == ()
    edges = [(channel, blocked) for _, channel, blocked, _ in line["edges"]]
    assert [(edge.channel, edge.blocked) for edge in drop.edges] == edges
    assert len(edges) > 20
    for edge, (seconds, *_) in zip(drop.edges, line["edges"], strict=True):
        assert abs(edge.tick - seconds * HZ * 1.002) <= 5  # edges come in mid-instruction
    assert identity.gates == len(BOARDS[board].gates)
    # What the outputs did: the release for as long as ordered, the sync for the whole recording.
    history = [change for change in port.board.history if change.pin != BOARDS[board].led]
    (on, off), (high, low) = (
        [change.cycle for change in history if change.pin == pin]
        for pin in (BOARDS[board].releases[0], BOARDS[board].sync)
    )
    assert on - high == BOARDS[board].sync_lead
    assert abs(off - on - 80e-3 * HZ) <= 1
    assert abs(low - high - 600e-3 * HZ) < 10e-3 * HZ
    assert (port.board.avr.overruns, port.board.avr.watchdog_resets) == (0, 0)


@cases
def test_what_is_wrong_in_the_url_is_bad_input(settings, complaint):
    with pytest.raises(InputError, match=complaint):
        open_port(url(**settings))


@pytest.mark.parametrize("word", rig.boards.BOARDS)
def test_the_table_of_boards_says_what_the_firmware_says(word):
    port = open_port(url(board=word))
    assert Device(port, port_clock(port)).connect().capabilities() == rig.boards.BOARDS[word]


def test_every_board_of_the_table_can_be_emulated():
    assert rig.boards.BOARDS.keys() == BOARDS.keys() | {"pico"}


def test_without_a_build_there_is_the_shipped_firmware(monkeypatch, tmp_path):
    package = tmp_path / "rig"
    (package / "flash").mkdir(parents=True)
    monkeypatch.setattr("rig_emulator.wiring.rig.__file__", str(package / "__init__.py"))
    with pytest.raises(InputError, match="no firmware for atmega2560") as caught:
        firmware_for(BOARDS["mega"])
    assert "make -C firmware" in caught.value.hint
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
        port = open_port(str(link))
        device = Device(port, port_clock(port))
        identity = device.connect(boot_wait_s=0)
        assert len(drop_from(device).edges) > 20
        port.close()
        port = open_port(str(link.readlink()))
        device = Device(port, port_clock(port))
        assert device.connect(boot_wait_s=0) == identity
        terminal.stdin.write("reset\n")
        terminal.stdin.flush()
        with pytest.raises(DeviceError, match="restarted"):
            device.collect(pack_label(1, 1), timeout=10.0)
        port.close()
        terminal.stdin.close()
        assert terminal.wait(PATIENCE_S) == 0
    assert not link.is_symlink()
