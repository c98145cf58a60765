"""Clients that get into each other's way: two that want control at once, some that never read."""

from __future__ import annotations

import socket
import subprocess
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

from bench.process_fixture import ProcessFixture, memory_bytes
from bench.tally import FaultTally
from rig.daemon import rpc
from rig.errors import DeviceError

if TYPE_CHECKING:
    from bench.process_fixture import Process

_RUNS = 2
_DEAF = 4  # clients that never read, in each session
_ASKED = 20_000  # snapshots, by each of them, as far as it may
_GROWTH = 24 << 20
"""Bytes by which a daemon may grow in a session, whoever does not read."""


def raced(count: int, seed: int, board: str = "sim") -> FaultTally:
    """Start two runners at once on one session, so many times.

    Parameters
    ----------
    count, seed, board
        As for `bench.faults.disturbed`.
    """
    tally = FaultTally()
    for n in range(count):
        with ProcessFixture(_RUNS, seed + n, board=board) as processes:
            processes.start_daemon()
            runners = [processes.start_runner() for _ in range(2)]
            told = [_ended(one) for one in runners]
            codes = sorted(code for code, _ in told)
            refused = any("has control" in said for _, said in told)
            # One that comes late finds the session finished, and has nothing to do.
            if codes not in ([0, DeviceError.exit_code], [0, 0]) or (codes[1] and not refused):
                tally.broken.append(f"both or none of two runners: {told}")
            tally.disturbed += bool(codes[1])
            tally.add_session(processes)
    return tally


def deaf(count: int, seed: int, board: str = "sim") -> FaultTally:
    """Make sessions beside clients that ask for everything and never read.

    Parameters
    ----------
    count, seed, board
        As for `bench.faults.disturbed`.
    """
    tally = FaultTally()
    for n in range(count):
        with ProcessFixture(_RUNS, seed + n, board=board) as processes, ExitStack() as lines:
            processes.start_daemon()
            processes.client().close()
            before = memory_bytes(processes.daemon)
            for _ in range(_DEAF):
                _ask_and_never_read(lines.enter_context(socket.socket(socket.AF_UNIX)), processes)
                tally.disturbed += 1
            if (code := processes.run()) != 0:
                tally.broken.append(f"a runner ended with {code}: {processes.told}")
            tally.memory_bytes = max(tally.memory_bytes, memory_bytes(processes.daemon) - before)
            if tally.memory_bytes > _GROWTH:
                tally.broken.append(f"the daemon grew by {tally.memory_bytes} bytes")
            tally.add_session(processes)
    return tally


def _ended(runner: Process) -> tuple[int, str]:
    try:
        _, told = runner.communicate(timeout=120)
    except subprocess.TimeoutExpired:
        runner.kill()
        return -1, "it does not end"
    return runner.returncode, told


def _ask_and_never_read(line: socket.socket, processes: ProcessFixture) -> None:
    line.connect(str(processes.socket))
    line.sendall(rpc.request("hello", {"api": rpc.API, "client": "deaf"}, 1))
    line.settimeout(0.2)
    with suppress(TimeoutError):  # the daemon does not take more than it can answer
        line.sendall(rpc.request("subscribe", {}, 2) * _ASKED)
