"""The examples in C, written from firmware/PROTOCOL.md alone, beside the project's own programs."""

import csv
import struct
import subprocess
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from rig.link.messages import Phase
from rig.selftest.findings import Verdict
from tests.firmware.toolchain import FIRMWARE, need
from tests.flash.pty_board import PtyBoard
from tests.link.talk import connected, record_drop
from tests.programs import run_program
from tests.selftest.benches import outcomes, port_of

FLAGS = "-std=c11 -O1 -Wall -Wextra -Wconversion -Wshadow -Werror -fsanitize=address,undefined"
FALL = [30_000, 42_000, 70_000, 82_000, 130_000, 142_000]  # µs, of its first rods
STEPPED = Path(__file__).with_name("stepped.c")
WRAP = [f"-Wl,--wrap={name}" for name in ("clock_gettime", "poll", "read", "write")]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    need("gcc")
    folder = tmp_path_factory.mktemp("examples")
    for name, source, more in (
        ("device", "device", []),
        ("client", "client", []),
        ("stepped", "device", [STEPPED, *WRAP]),
    ):
        sources = [FIRMWARE / f"examples/{part}.c" for part in (source, "frames")]
        command = ["gcc", *FLAGS.split(), "-o", folder / name, *sources, *more]
        run_program(*command)
    return folder


@contextmanager
def device_of(built):
    """Run the device; give the terminal that it is behind."""
    with subprocess.Popen([built / "device"], stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:  # else a test that fails would wait for it
            process.terminate()


def client(built, port, gates, record_ms):
    """Let the client make a drop; give its rows of ticks since FIRE and state."""
    command = [built / "client", port, hex(gates), str(record_ms)]
    # A device that a busy computer keeps from hearing of the client for 250 ms disarms itself.
    tries = (run_program(*command, code=None) for _ in range(3))
    done = next(tried for tried in tries if tried.returncode == 0)
    head, *rows = csv.reader(done.stdout.splitlines())
    assert head == ["ticks since FIRE", "state"]
    return [(int(tick), int(state)) for tick, state in rows]


class SteppedDevice:
    """The device at a simulated port: its clock is the port's, however busy the computer is."""

    byte_ns = 20_000

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process, self.line = process, self
        process.stdout.readline()  # the terminal that it is not behind
        self.now_us, self.waiting = 0, self._sent()

    def _sent(self) -> bytes:
        (count,) = struct.unpack("I", self.process.stdout.read(4))
        return self.process.stdout.read(count)

    def receive(self, at_ns: int, data: bytes) -> None:
        self.process.stdin.write(struct.pack("II", at_ns // 1000, len(data)) + data)
        self.process.stdin.flush()
        self.now_us = at_ns // 1000
        self.waiting += self._sent()

    def advance(self, until_ns: int) -> None:
        if until_ns // 1_000_000 > self.now_us // 1000:  # it looks at its clock once a millisecond
            self.receive(until_ns, b"")

    def next_ns(self) -> int:
        return (self.now_us // 1000 + 1) * 1_000_000

    def next_arrival_ns(self) -> int | None:
        return self.now_us * 1000 if self.waiting else None

    def read(self, now_ns: int) -> bytes:
        data, self.waiting = self.waiting, b""
        return data


def test_the_device_passes_the_selftest(built):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([built / "stepped"], **pipes) as process:
        found = outcomes(
            port_of(SteppedDevice(process), reset_on_open=False), loopback=None, release=False
        )
    assert [str(one) for one in found.values() if one.verdict is Verdict.FAILED] == []
    assert found["handshake"].what.startswith("an example in C, example 1")
    assert found["repeated frames"].verdict is Verdict.OK
    assert found["a silent host disarms"].what == "after 250 ms"


def test_its_drop_is_read_by_this_project_and_by_the_client(built):
    with device_of(built) as path:
        port, device = connected(path)
        with closing(port):
            drop = record_drop(device, gates=3, release=0, pulse_us=0)
            assert drop.faults == ()
            assert [edge.tick for edge in drop.edges] == FALL
            assert [edge.channel for edge in drop.edges] == [0, 0, 1, 1, 0, 0]
        # It was not acknowledged: the client finds it, and lets the device forget it.
        assert client(built, path, 3, 100) == list(zip(FALL, [1, 0, 2, 0, 1, 0], strict=True))
        assert [tick for tick, _ in client(built, path, 1, 60)] == FALL[:2]


def test_the_client_reads_a_drop_of_the_simulated_board(built):
    with PtyBoard() as there:
        assert client(built, there.path, 1, 100) == []
        port, device = connected(there.path, boot_wait_s=0)
        with closing(port):
            assert device.status().phase is Phase.IDLE
