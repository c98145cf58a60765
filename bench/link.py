"""How much the link bears: decoding alone, and from a terminal by way of the disk to a client.

The stream is EVENTS frames, as a board sends them. Beside it, as a rival: a decoder that takes
bytes one by one, the way pyFirmata does. What a processor does alone is told by its own time; the
rest needs a machine with nothing else to do, so the load is told too.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.decoding import bytewise, checked, frames, speed, to_edges
from bench.process_fixture import ProcessFixture, memory_bytes, processor_s
from bench.pty_writer import PtyWriter
from bench.streaming import fire, serve, spread
from rig.bench.findings import Findings
from rig.clock.host import SystemClock
from rig.commands.output import say
from rig.link.exchange import Exchange
from rig.link.messages import EVENTS_PER_FRAME
from rig.link.port import open_port
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Iterator, Mapping

    from rig.daemon.server import Server

_HEAD = """\
# Speed of the link

`./run bench link`: edges a second, their delay, and the cost of an idle daemon. Times are of one
machine."""
_FRAMES = 65_000 // EVENTS_PER_FRAME  # the number of an event is a u16
_RATE = 5000.0  # edges a second, where latency is measured
_STEADY_FRAMES = 500
_IDLE_S = 5.0
_BEST_OF = 3
_FLOOD = """
import json, sys
from bench.link import delivered
from bench.process_fixture import memory_bytes
rate, _ = delivered(int(sys.argv[1]), 0.0)
print(json.dumps([rate, memory_bytes(None) / 2**20]))
"""
_WATCH = """
import asyncio, json, sys, time
from pathlib import Path
from rig.daemon.client import AsyncClient

async def watch(path, wanted):
    client, seen = await AsyncClient.connect(path, "bench"), []
    done = asyncio.Event()
    def changed():
        count = len(client.replica.state.get("edges", ()))
        if not seen or seen[-1][0] != count:
            seen.append((count, time.monotonic()))
        if count >= wanted:
            done.set()
    client.changed = changed
    await client.call("subscribe")
    print("ready", flush=True)
    await asyncio.wait_for(done.wait(), 60)
    print(json.dumps(seen))
    await client.close()

asyncio.run(watch(Path(sys.argv[1]), int(sys.argv[2])))
"""


def _latencies(
    times: list[float], ends: list[int], seen: Iterable[tuple[int, float]]
) -> list[float]:
    """From when each frame was sent until so much had been seen."""
    arrived = iter(seen)
    count, at = next(arrived)
    latencies = []
    for sent, end in zip(times, ends, strict=True):
        while count < end:
            count, at = next(arrived)
        latencies.append(at - sent)
    return latencies


def delivered(count: int, every_s: float) -> tuple[float, list[float]]:
    """Send frames through terminal, reader, session file, state and socket to another process.

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
    wanted, terminal = count * EVENTS_PER_FRAME, PtyWriter(frames(count), every_s)
    with TemporaryDirectory(prefix="rig-") as folder:
        seen = serve(Path(folder), partial(_record, Path(folder), terminal, count))
    times = terminal.sent()
    terminal.close()
    ends = [(number + 1) * EVENTS_PER_FRAME for number in range(count)]
    return wanted / (seen[-1][1] - times[0]), _latencies(times, ends, seen)


def _record(
    folder: Path, terminal: PtyWriter, count: int, server: Server
) -> list[tuple[int, float]]:
    """Do what the worker does while a drop is recorded; return when a client had how many edges."""
    command = [sys.executable, "-c", _WATCH, str(server.path), str(count * EVENTS_PER_FRAME)]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE) as client,
        Session.create(
            folder / "session", "protocol: 1\n", "bench", simulated=True, origin="bench"
        ) as session,
    ):
        assert client.stdout is not None
        client.stdout.readline()
        view, port = fire(server), open_port(terminal.path)
        line = Exchange(port, SystemClock(), session.log_bytes, view.know, 1)
        terminal.start()
        while line.transcript.rx.good < count:
            line.receive()
        session.commit()
        port.close()
        seen: list[tuple[int, float]] = json.loads(client.stdout.read())
    return seen


def idle() -> dict[str, float]:
    """CPU share and memory of a daemon with a board and nothing to do, and with a watcher."""
    found = {}
    with ProcessFixture(1) as processes:
        processes.start_daemon()
        assert processes.daemon is not None
        with_client = processes.client()
        with_client.call("subscribe")
        time.sleep(3.0)  # the board has been found
        for name in ("watched", "alone"):
            if name == "alone":
                with_client.close()
                time.sleep(1.5)
            before = processor_s(processes.daemon.pid)
            time.sleep(_IDLE_S)
            found[f"{name}_cpu"] = (processor_s(processes.daemon.pid) - before) / _IDLE_S
        found["memory_mb"] = memory_bytes(processes.daemon, "VmRSS") / 2**20
    return found


def flood() -> tuple[float, float]:
    """Send as many edges as one drop can have, as fast as possible.

    Returns
    -------
    float, float
        Edges a second to the client, and the most memory, MB, of the process that serves: both
        the best of a few, each a fresh process.
    """
    found: list[tuple[float, float]] = []
    for _ in range(_BEST_OF):
        told = subprocess.run(
            [sys.executable, "-c", _FLOOD, str(_FRAMES)], stdout=subprocess.PIPE, check=True
        )
        rate, memory = json.loads(told.stdout)
        found.append((rate, memory))
    return max(rate for rate, _ in found), min(memory for _, memory in found)


def run(_arguments: Namespace) -> Iterator[Findings]:
    """Measure the way from the port to a client."""
    figures = link()
    yield Findings(figures, [*_lines(figures)], _HEAD)


def link() -> dict[str, Any]:
    """Measure everything, in one go."""
    say("decoding …")
    rates = {
        "decoded": speed(checked, _FRAMES),
        "decoded_to_edges": speed(to_edges, _FRAMES),
        "decoded_bytewise": speed(bytewise, _FRAMES // 10),
    }
    say("delivering …")
    rates["recorded_and_delivered"], busy_mb = flood()
    every_s = EVENTS_PER_FRAME / _RATE
    say("idling …")
    return {
        "edges_per_s": rates,
        "latency_at_5000_per_s_s": spread(delivered(_STEADY_FRAMES, every_s)[1]),
        "idle": idle(),
        "busy": {"memory_mb": busy_mb},
        "load": os.getloadavg()[0],
        "cores": os.cpu_count(),
    }


def _lines(found: Mapping[str, Any]) -> Iterator[str]:
    for name, rate in found["edges_per_s"].items():
        yield f"{name.replace('_', ' '):<28}{rate:>12,.0f} edges/s"
    median, p99 = (1e3 * late for late in found["latency_at_5000_per_s_s"].values())
    yield f"{'latency at 5000 edges/s':<28}{median:>7.1f} ms, p99 {p99:.1f} ms"
    idle = found["idle"]
    yield f"{'idle daemon':<28}{idle['alone_cpu']:>12.1%} of a core"
    yield f"{'with one who watches':<28}{idle['watched_cpu']:>12.1%} of a core"
    yield f"{'memory, idle':<28}{idle['memory_mb']:>12.0f} MB"
    yield f"{'memory, most in a flood':<28}{found['busy']['memory_mb']:>12.0f} MB"
    yield f"{'load of the machine':<28}{found['load']:>12.1f} on {found['cores']} cores"
