"""Ports at another computer, pyserial's other URLs, and what opening says when it cannot."""

import socket
import sys

import pytest
from serial import SerialException

from rig.errors import DeviceError
from rig.link.client import Device
from rig.link.port import open_port, port_clock
from tests.daemon.far_port import FarPort
from tests.flash.pty_board import PtyBoard
from tests.link.bench import LABEL, ScriptedLab, falling_rods
from tests.link.talk import arm
from tests.waiting import until


@pytest.fixture
def bridge():
    lab = ScriptedLab(changes=falling_rods())
    with PtyBoard(lab) as board, FarPort(board.path, "socket") as bridge:
        yield bridge


def connected(url, tap=lambda *_: None):
    port = open_port(url)
    device = Device(port, port_clock(port), tap)
    device.connect(boot_wait_s=0.5)
    return port, device


def test_a_drop_comes_whole_over_tcp_and_outlives_a_reconnect(bridge):
    chunks = []
    port, device = connected(bridge.url, lambda *chunk: chunks.append(chunk))
    device.fire(arm(device))
    drop = device.collect(LABEL)
    port.close()
    assert drop.faults == ()
    assert len(drop.edges) == len(falling_rods())
    received = [data for direction, _, data in chunks if direction == "rx"]
    assert sum(map(len, received)) / len(received) > 8  # not byte by byte
    port, again = connected(bridge.url)
    assert again.fetch(LABEL) == drop
    port.close()


def test_a_connection_that_ends_is_said(bridge):
    port, device = connected(bridge.url)
    bridge.hang_up()
    with pytest.raises(DeviceError, match=r"the port is gone|reset by peer|Broken pipe"):
        device.status()
    port.close()


def test_what_has_arrived_is_counted():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = open_port(f"socket://127.0.0.1:{server.getsockname()[1]}")
        other, _ = server.accept()
        with other:
            other.sendall(bytes(300))
            until(lambda: port.in_waiting == 300)
            assert port.read(300) == bytes(300)
            assert port.in_waiting == 0
            assert port.read(1) == b""  # nobody sends any more, and nothing is waited for
        port.close()
    with pytest.raises(OSError):
        assert port.in_waiting


def test_nothing_listens():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    with pytest.raises(DeviceError, match=f":{number}: Connection refused") as caught:
        open_port(f"socket://127.0.0.1:{number}")
    assert "HOST:PORT" in caught.value.hint


@pytest.mark.parametrize("url", ["socket://lab", "socket://127.0.0.1:99999", "socket://"])
def test_what_is_no_address(url):
    with pytest.raises(DeviceError, match=f"cannot open {url}: ") as caught:
        open_port(url)
    assert "HOST:PORT" in caught.value.hint


def test_no_such_computer(monkeypatch):
    def nobody(*_args, **_kwargs):
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr("socket.create_connection", nobody)
    with pytest.raises(DeviceError, match="cannot open socket://nowhere"):
        open_port("socket://nowhere.invalid:7000")


def test_a_program_that_does_not_speak_rfc_2217(monkeypatch):
    said = "Remote does not seem to support RFC2217"

    def fail(_port):
        raise SerialException(said)

    monkeypatch.setattr("serial.rfc2217.Serial.open", fail)
    with pytest.raises(DeviceError, match=f"cannot open rfc2217://lab:7: {said}") as caught:
        open_port("rfc2217://lab:7")
    assert "firewall" in caught.value.hint


def test_a_missing_emulator_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "rig_emulator", None)  # importing it now fails
    with pytest.raises(DeviceError, match="emulator is not installed") as caught:
        open_port("emu://?protocol=x.yaml")
    assert "./firmware/emulator" in caught.value.hint
    assert "libsimavr-dev" in caught.value.hint
