"""How much the link bears: decoding alone, and from a terminal by way of the disk to a client.

The stream is EVENTS frames, as a board sends them. Beside it, as limits from both sides: reading
the same bytes with pyserial and doing nothing with them, and a decoder that takes them one by one,
the way pyFirmata does.
"""

from __future__ import annotations

import asyncio
import json
import os
import pty
import subprocess
import sys
import time
import tty
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from rig.bench.stand import Stand
from rig.daemon.server import Server
from rig.daemon.view import View
from rig.link.clock import SystemClock
from rig.link.exchange import Exchange
from rig.link.frames import Frame, cobs_decode, crc16, encode
from rig.link.messages import EVENTS_PER_FRAME, Event, EventsFrame, Fired, pack, pack_label
from rig.link.port import open_port
from rig.link.transcript import Received, Transcript
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable

_FRAMES = 65_000 // EVENTS_PER_FRAME  # the number of an event is a u16
_RATE = 5000.0  # edges a second, where latency is measured
_STEADY_FRAMES = 500
_IDLE_S = 5.0
_WRITE = """
import json, os, sys, time
far, every_s = int(sys.argv[1]), float(sys.argv[2])
data, at, frames, sent = sys.stdin.buffer.read(), 0, [], []
while at < len(data):
    size = int.from_bytes(data[at : at + 2], "little")
    frames.append(data[at + 2 : at + 2 + size])
    at += 2 + size
begun = time.monotonic()
for number, frame in enumerate(frames):
    left = begun + number * every_s - time.monotonic()
    if every_s and left > 0:
        time.sleep(left)
    sent.append(time.monotonic())
    while frame:
        frame = frame[os.write(far, frame):]
print(json.dumps(sent))
"""
_WATCH = """
import asyncio, json, sys, time
from pathlib import Path
from rig.daemon.aclient import AsyncClient

async def watch(path, wanted):
    client, seen = await AsyncClient.connect(path, "bench"), []
    done = asyncio.Event()
    def changed():
        count = len(client.mirror.state.get("edges", ()))
        if not seen or seen[-1][0] != count:
            seen.append((count, time.monotonic()))
        if count >= wanted:
            done.set()
    client.changed = changed
    await client.subscribe()
    print("ready", flush=True)
    await asyncio.wait_for(done.wait(), 60)
    print(json.dumps(seen))
    await client.close()

asyncio.run(watch(Path(sys.argv[1]), int(sys.argv[2])))
"""


def frames(count: int) -> list[bytes]:
    """Make EVENTS frames of one drop; each event is one edge of gate 0."""
    made = []
    for number in range(count):
        first = number * EVENTS_PER_FRAME
        events = tuple(
            Event((first + n) * 3200 % 2**32, (first + n + 1) % 2) for n in range(EVENTS_PER_FRAME)
        )
        code, payload = pack(EventsFrame(pack_label(1, 1), first, events))
        made.append(encode(Frame(code, number % 255 + 1, 0, payload)))
    return made


def decoded_alone() -> float:
    """Edges a second through the transcript, in chunks as a port gives them."""
    data = b"".join(frames(_FRAMES))
    transcript = Transcript()
    begun = time.perf_counter()
    for at in range(0, len(data), 4096):
        transcript.feed("rx", 0, data[at : at + 4096])
    return _FRAMES * EVENTS_PER_FRAME / (time.perf_counter() - begun)


def decoded_bytewise() -> float:
    """Edges a second by a decoder that looks at each byte, and at each event's bytes."""
    data = b"".join(frames(_FRAMES // 10))
    edges: list[tuple[int, int]] = []
    state, waiting = 0, bytearray()
    begun = time.perf_counter()
    for byte in data:
        if byte:
            waiting.append(byte)
            continue
        body = cobs_decode(bytes(waiting))
        waiting.clear()
        if crc16(body[:-2]) != body[-2] | body[-1] << 8:
            continue
        for at in range(9, len(body) - 2, 6):
            tick = body[at] | body[at + 1] << 8 | body[at + 2] << 16 | body[at + 3] << 24
            now = body[at + 4] | body[at + 5] << 8
            edges += [(tick, channel) for channel in range(16) if (state ^ now) >> channel & 1]
            state = now
    return len(edges) / (time.perf_counter() - begun)


class _Terminal:
    """A raw terminal, and a process that writes into its far end."""

    def __init__(self, data: list[bytes], every_s: float) -> None:
        self._far, self._near = pty.openpty()
        tty.setraw(self._near)
        self.path = os.ttyname(self._near)
        self._data = b"".join(len(frame).to_bytes(2, "little") + frame for frame in data)
        self._writer = subprocess.Popen(  # noqa: S603 - our own program
            [sys.executable, "-c", _WRITE, str(self._far), str(every_s)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pass_fds=[self._far],
        )

    def start(self) -> None:
        """Begin to write."""
        assert self._writer.stdin is not None
        self._writer.stdin.write(self._data)
        self._writer.stdin.close()

    def sent(self) -> list[float]:
        """Return when each frame was written, s (monotonic)."""
        assert self._writer.stdout is not None
        times: list[float] = json.loads(self._writer.stdout.read())
        self._writer.wait()
        self._writer.stdout.close()
        return times

    def close(self) -> None:
        """Hang up."""
        os.close(self._far)
        os.close(self._near)


def read_alone() -> float:
    """Edges a second that pyserial reads through a terminal and nobody looks at."""
    data = frames(_FRAMES)
    size = sum(map(len, data))
    terminal = _Terminal(data, 0.0)
    port = open_port(terminal.path)
    terminal.start()
    got = 0
    while got < size:
        got += len(port.read(max(1, port.in_waiting)))
    taken = time.monotonic() - terminal.sent()[0]
    port.close()
    terminal.close()
    return _FRAMES * EVENTS_PER_FRAME / taken


def delivered(count: int, every_s: float) -> tuple[float, list[float]]:
    """Send frames through terminal, reader, session file, hub and socket to another process.

    Parameters
    ----------
    count
        Frames.
    every_s
        Seconds from one to the next; 0 for as fast as possible.

    Returns
    -------
    float, list of float
        Edges a second over all, and the latency of each frame, s.
    """
    with TemporaryDirectory(prefix="rig-") as folder:
        return asyncio.run(_deliver(Path(folder), count, every_s))


async def _deliver(folder: Path, count: int, every_s: float) -> tuple[float, list[float]]:
    loop = asyncio.get_running_loop()
    server, ready = Server("sim://", folder / "door" / "rig.sock"), asyncio.Event()
    serving = loop.create_task(server.run(ready.set))
    await ready.wait()
    wanted = count * EVENTS_PER_FRAME
    client = subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-c", _WATCH, str(server.path), str(wanted)], stdout=subprocess.PIPE
    )
    assert client.stdout is not None
    await loop.run_in_executor(None, client.stdout.readline)
    terminal = _Terminal(frames(count), every_s)
    await loop.run_in_executor(None, _read, folder, server, terminal, count)
    seen = json.loads(await loop.run_in_executor(None, client.stdout.read))
    client.wait()
    client.stdout.close()
    server.end()
    await serving
    times = terminal.sent()
    terminal.close()
    arrived = iter(seen)
    edges, at = next(arrived)
    latencies = []
    for number, sent in enumerate(times):
        while edges < (number + 1) * EVENTS_PER_FRAME:
            edges, at = next(arrived)
        latencies.append(at - sent)
    return wanted / (at - times[0]), latencies


def _read(folder: Path, server: Server, terminal: _Terminal, count: int) -> None:
    """Do what the worker does while a drop is recorded."""
    with Session.create(
        folder / "session", "protocol: 1\n", "bench", simulated=True, origin="bench"
    ) as session:
        view = View(server.hub)
        view.state(1, 1, RunState.ARMED, ())
        view.know(Received(0, 1, Fired(0)))
        port = open_port(terminal.path)
        line = Exchange(port, SystemClock(), session.log_bytes, view.know, 1)
        terminal.start()
        while line.transcript.good_frames < count:
            line.receive()
        session.commit()
        port.close()


def idle() -> dict[str, float]:
    """CPU share and memory of a daemon with a board and nothing to do, and with a watcher."""
    found = {}
    with Stand(1) as stand:
        stand.start_daemon()
        assert stand.daemon is not None
        with_client = stand.client()
        with_client.call("subscribe")
        time.sleep(3.0)  # the board has been found
        for name in ("watched", "alone"):
            if name == "alone":
                with_client.close()
                time.sleep(1.5)
            before = _cpu_s(stand.daemon.pid)
            time.sleep(_IDLE_S)
            found[f"{name}_cpu"] = (_cpu_s(stand.daemon.pid) - before) / _IDLE_S
        found["memory_mb"] = _memory_mb(stand.daemon.pid)
    return found


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _memory_mb(pid: int) -> float:
    text = Path(f"/proc/{pid}/status").read_text("ascii")
    return int(text.partition("VmRSS:")[2].split()[0]) / 1024


def link(say: Callable[[str], None]) -> dict[str, Any]:
    """Measure everything, in one go.

    Parameters
    ----------
    say
        Narration.
    """
    say("decoding …")
    found: dict[str, Any] = {
        "edges_per_s": {
            "decoded": decoded_alone(),
            "decoded_bytewise": decoded_bytewise(),
            "read_by_pyserial_alone": read_alone(),
        }
    }
    say("delivering …")
    found["edges_per_s"]["recorded_and_delivered"] = delivered(_FRAMES, 0.0)[0]
    _, latencies = delivered(_STEADY_FRAMES, EVENTS_PER_FRAME / _RATE)
    latencies.sort()
    found["latency_at_5000_per_s_s"] = {
        "median": latencies[len(latencies) // 2],
        "p99": latencies[len(latencies) * 99 // 100],
    }
    say("idling …")
    found["idle"] = idle()
    return found
