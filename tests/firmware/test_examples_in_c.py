"""The examples in C, written from firmware/PROTOCOL.md alone, beside the project's own programs."""

from __future__ import annotations

import csv
import subprocess
from contextlib import closing, contextmanager

import pytest

from rig.cli import main
from rig.link.client import Device
from rig.link.messages import Phase
from rig.link.port import open_port, port_clock
from tests.firmware.toolchain import FIRMWARE, need
from tests.flash.pty_board import PtyBoard
from tests.link.bench import LABEL

FLAGS = "-std=c11 -O1 -Wall -Wextra -Wconversion -Wshadow -Werror -fsanitize=address,undefined"
FALL = [30_000, 42_000, 70_000, 82_000, 130_000, 142_000]  # µs, of its first rods
ORDER = {"gates": 3, "release": 0, "pulse_us": 0, "timeout_ms": 500, "record_ms": 150}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    need("gcc")
    folder = tmp_path_factory.mktemp("examples")
    for name in ("device", "client"):
        sources = [FIRMWARE / f"examples/{name}.c", FIRMWARE / "examples/frames.c"]
        command = ["gcc", *FLAGS.split(), "-o", folder / name, *sources]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    return folder


@contextmanager
def device_of(built):
    """Run the device; give the terminal that it is behind."""
    with subprocess.Popen([built / "device"], stdout=subprocess.PIPE, text=True) as process:
        yield process.stdout.readline().strip()
        process.terminate()


def client(built, port, gates, record_ms):
    """Let the client make a drop; give its rows of ticks since FIRE and state."""
    command = [built / "client", port, hex(gates), str(record_ms)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    head, *rows = csv.reader(done.stdout.splitlines())
    assert head == ["ticks since FIRE", "state"]
    return [(int(tick), int(state)) for tick, state in rows]


def test_the_device_passes_the_selftest(built, capsys):
    with device_of(built) as path:
        main(["selftest", "--port", path])
    out, _ = capsys.readouterr()
    failed = [line for line in out.splitlines() if ": failed" in line]
    # How fast a busy computer is says nothing of the device.
    assert [line for line in failed if not line.startswith("round trips: ")] == []
    assert "handshake: ok: an example in C, example 1" in out
    assert "repeated frames: ok" in out


def test_its_drop_is_read_by_this_project_and_by_the_client(built):
    with device_of(built) as path:
        with closing(open_port(path)) as port:
            device = Device(port, port_clock(port))
            device.connect()
            device.fire(device.arm(label=LABEL, **ORDER))
            drop = device.collect(LABEL)
            assert drop.faults == ()
            assert [edge.tick for edge in drop.edges] == FALL
            assert [edge.channel for edge in drop.edges] == [0, 0, 1, 1, 0, 0]
        # It was not acknowledged: the client finds it, and lets the device forget it.
        assert client(built, path, 3, 100) == list(zip(FALL, [1, 0, 2, 0, 1, 0], strict=True))
        assert [tick for tick, _ in client(built, path, 1, 60)] == FALL[:2]


def test_the_client_reads_a_drop_of_the_simulated_board(built):
    with PtyBoard() as there:
        assert client(built, there.path, 1, 100) == []
        with closing(open_port(there.path)) as port:
            device = Device(port, port_clock(port))
            device.connect(boot_wait_s=0)
            assert device.status().phase is Phase.IDLE
