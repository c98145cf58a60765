"""How long STOP takes from a client's request to the wire, whatever holds the daemon up."""

from __future__ import annotations

import sqlite3
import statistics
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Timer
from typing import TYPE_CHECKING

import numpy as np

from bench.failing_disk import FailingDisk
from bench.process_fixture import ProcessFixture
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.daemon import rpc
from rig.errors import InputError, RigError
from rig.link.frames import Decoder
from rig.link.messages import CODES, Abort
from rig.session.store import Session
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator

    from rig.daemon.client import Client

_FLOOD = 60  # requests that wait in the daemon, of each of the clients that flood it
_FLOODERS = 8
LIMIT_S = 0.05
_FROZEN_S = 3.0


def run(arguments: Namespace) -> Iterator[Findings]:
    """Measure each condition; a promise is broken when any took longer than it may."""
    times = {name: measured(held, arguments.stops) for name, held in CONDITIONS.items()}
    try:
        times["disk frozen"] = _measured_frozen(arguments.stops)
    except InputError as error:
        say(f"left out: a frozen disk ({error.message})")
    rows = [["", "stops", "median ms", "p99 ms", "max ms"]]
    for name, values in times.items():
        figures = statistics.median(values), float(np.quantile(values, 0.99)), max(values)
        rows.append([name, str(len(values)), *(f"{seconds * 1e3:.2f}" for seconds in figures)])
    late = any(max(values) > LIMIT_S for values in times.values())
    yield Findings(times, text_table(rows, left={0}, rule=True), failed=late)


def measured(
    held: Callable[[ProcessFixture], Iterator[None]], stops: int, folder: Path | None = None
) -> list[float]:
    """Stop an armed rig so often, and find in its log of bytes when ABORT left, s.

    Parameters
    ----------
    held
        What holds the daemon up meanwhile.
    stops
        How often.
    folder
        For the session; by default on a disk that can be filled.
    """
    asked = []
    with ProcessFixture(runs=1, small_disk=folder is None) as processes:
        if folder is not None:
            processes.session = folder / "session"
        processes.start_daemon()
        with closing(processes.client("in control")) as one, closing(processes.client()) as two:
            one.take_control()
            one.open_session(str(processes.protocol), str(processes.session))
            for attempt in range(1, stops + 1):
                _arm(one, attempt)
                with contextmanager(held)(processes):
                    asked.append(time.monotonic_ns())
                    with suppress(RigError):
                        two.stop("measured")
                _settled(one)
        left = _aborts(processes)
    return [(next(at for at in left if at >= begun) - begun) * 1e-9 for begun in asked]


def _arm(client: Client, attempt: int) -> None:
    while True:
        try:
            client.arm(1, attempt)
        except RigError:
            _settled(client)
        else:
            return


def _settled(client: Client) -> None:
    """Wait until the daemon has no trouble any more."""
    while client.call("subscribe")["state"]["error"] is not None:
        time.sleep(0.05)
    client.stop("whatever is armed still")


def _aborts(processes: ProcessFixture) -> list[int]:
    decoder = Decoder()
    with Session.open(processes.session, readonly=True) as session:
        return [
            chunk.host_ns
            for chunk in session.byte_log()
            if chunk.direction == "tx"
            if any(frame.type == CODES[Abort] for frame in decoder.feed(chunk.data))
        ]


def _quiet(_: ProcessFixture) -> Iterator[None]:
    yield


def _flood(processes: ProcessFixture) -> Iterator[None]:
    """Have other clients ask for whole snapshots all the time."""
    with ExitStack() as stack:
        for number in range(_FLOODERS):
            client = stack.enter_context(closing(processes.client(f"flood {number}")))
            line = b"".join(rpc.request("subscribe", {}, n) for n in range(_FLOOD))
            client.line._socket.sendall(line)
        yield


def _stalled(processes: ProcessFixture) -> Iterator[None]:
    """Hold the session's lock, so that each write of the daemon waits 2 s."""
    # The daemon holds the lock itself until what it has logged is committed.
    with closing(sqlite3.connect(processes.session, 60.0, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with closing(processes.client("looking on")) as client:
            while not client.call("renew")["disk_s"]:
                pass
            yield


def _measured_frozen(stops: int) -> list[float]:
    with TemporaryDirectory(prefix="rig-") as place, FailingDisk(Path(place)) as disk:

        def frozen(processes: ProcessFixture) -> Iterator[None]:
            """Have no write come back for a time; the daemon is at one soon."""
            with closing(processes.client("looking on")) as client:
                disk.freeze()
                thaw = Timer(_FROZEN_S, disk.thaw)
                thaw.start()
                while not client.call("renew")["disk_s"]:
                    pass
            yield
            thaw.join()

        return measured(frozen, stops, disk.folder)


def _full(processes: ProcessFixture) -> Iterator[None]:
    """Leave no room on the disk."""
    assert processes.disk is not None
    processes.disk.fill(processes.daemon)
    try:
        yield
    finally:
        processes.disk.free(processes.daemon)


CONDITIONS = {"quiet": _quiet, "flood": _flood, "disk stalled": _stalled, "disk full": _full}
