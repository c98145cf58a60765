"""What the screen costs: its share of a core, how late it is, and when it is there.

The real program in a real terminal: ``rig tui`` as a process of its own behind a pseudo-terminal, a
client of a daemon's server, whose view is told of edges as by a board's stream. The share is
processor time, which other programs on the machine change little; lateness does depend on them.
"""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import sys
import termios
import threading
import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Self

from bench.process_fixture import processor_s
from bench.streaming import fire, serve, spread
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.daemon.client import Client, Line
from rig.session.store import Session
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Sequence

    from rig.daemon.server import Server

_HEAD = """\
# Speed of the terminal

`./run bench tui`: the real program in a real terminal. Times are of one machine."""
RATE = 5000.0
"""Edges a second."""
SIZE = (120, 36)
_LASTING_S = 8.0
_TOGETHER_S = 0.01  # a board sends what waited for so long
_GATES = 16
_TICK_HZ = 16_000_000
_THERE = b"STOP"
_COUNTED = re.compile(rb"FALLING  (\d+) edges")
_RESULTS = "Δz".encode()
_PATIENCE_S = 60.0
_RIG = (sys.executable, "-m", "rig")


class Terminal:
    """A terminal with ``rig tui`` in it.

    Parameters
    ----------
    arguments
        Of ``rig tui``.

    Attributes
    ----------
    written
        What the program wrote, and when, s (monotonic).
    """

    def __init__(self, *arguments: str | Path) -> None:
        self.written: list[tuple[float, bytes]] = []
        self._far, near = pty.openpty()
        termios.tcsetwinsize(near, SIZE[::-1])
        self.begun = time.monotonic()
        self.process = subprocess.Popen(
            [*_RIG, "tui", *map(str, arguments)],
            stdin=near,
            stdout=near,
            stderr=near,
            start_new_session=True,
            env=os.environ | {"TERM": "xterm-256color", "OPENBLAS_NUM_THREADS": "1"},
        )
        os.close(near)
        self._over = threading.Event()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exc: object) -> None:
        self.process.terminate()
        self.process.wait()
        self._over.set()
        self._reader.join()
        os.close(self._far)

    def press(self, keys: bytes) -> None:
        """Press keys."""
        os.write(self._far, keys)

    def until(self, text: bytes) -> dict[str, float]:
        """Wait until something was written; return after what time, also of the processor's."""
        end = time.monotonic() + _PATIENCE_S
        while time.monotonic() < end:
            for at, data in list(self.written):
                if text in data:
                    return {"wall_s": at - self.begun, "cpu_s": processor_s(self.process.pid)}
            time.sleep(0.01)
        raise TimeoutError(f"{text!r} does not appear on the screen")

    def _read(self) -> None:
        while not self._over.is_set():
            if select.select([self._far], [], [], 0.05)[0]:
                try:
                    self.written.append((time.monotonic(), os.read(self._far, 1 << 16)))
                except OSError:
                    return  # it has left


def _opened(folder: Path, protocol: str) -> dict[str, Any]:
    say("a whole session of the protocol …")
    session = folder / "whole.session"
    subprocess.run(
        [*_RIG, "run", protocol, "--port", "sim://", "--session", session, "--yes"],
        check=True,
        capture_output=True,
    )
    with Session.open(session, readonly=True) as opened:
        drops = len(opened.latest_drops())
    with Terminal("--session", session) as terminal:
        paint, whole = terminal.until(_THERE), terminal.until(_RESULTS)
    rest = {name: whole[name] - paint[name] for name in paint}
    before = os.times()
    subprocess.run(
        [*_RIG, "report", session, "-o", folder / "report.html"], check=True, capture_output=True
    )
    return {
        "opened": {"runs": drops, "after_paint": rest, **whole},
        "report_cpu_s": sum(os.times()[2:4]) - sum(before[2:4]),
    }


def _in_terminal(folder: Path, protocol: str, server: Server) -> dict[str, Any]:
    client = Client(Line(server.path, "bench"))
    client.take_control()
    client.open_session(protocol, str(folder / "bench.session"))
    try:
        with Terminal("--socket", server.path) as terminal:
            say("first paint …")
            first = terminal.until(_THERE)
            terminal.until(b"clear")  # the session is read, and shown
            time.sleep(2.0)
            say("a quiet screen …")
            quiet = _share(terminal, lambda: time.sleep(_LASTING_S / 2))
            say(f"{RATE:.0f} edges a second …")
            shown = len(terminal.written)
            sent: list[tuple[float, int]] = []
            live = _share(terminal, lambda: _feed(server, sent))
            return {
                "first_paint": first,
                "quiet_cpu": quiet,
                "edges_per_s": sent[-1][1] / (sent[-1][0] - sent[0][0]),
                "live_cpu": live,
                **_lateness(terminal.written[shown:], sent, live),
            }
    finally:
        client.close()


def _share(terminal: Terminal, work: Callable[[], object]) -> float:
    """Processor time of the screen's process over time gone by."""
    before, begun = processor_s(terminal.process.pid), time.monotonic()
    work()
    return (processor_s(terminal.process.pid) - before) / (time.monotonic() - begun)


def _feed(server: Server, sent: list[tuple[float, int]]) -> None:
    """Let a drop's edges come as a stream; note how many there were when, s (monotonic)."""
    fire(server)
    begun, count = time.monotonic(), 0
    while (now := time.monotonic() - begun) < _LASTING_S:
        wanted = int(now * RATE)
        server.published.edges(
            (round(n / RATE * _TICK_HZ), n % _GATES, n // _GATES % 2) for n in range(count, wanted)
        )
        count = wanted
        sent.append((time.monotonic(), count))
        time.sleep(_TOGETHER_S)


def _lateness(
    written: Sequence[tuple[float, bytes]], sent: Sequence[tuple[float, int]], share: float
) -> dict[str, Any]:
    """Compare the counts on the screen with those that were true then."""
    late: list[float] = []
    for at, data in written:
        for told in _COUNTED.findall(data):
            newer = next((when for when, count in sent if count > int(told)), at)
            late.append(max(0.0, at - newer))
    frames = len(late) / _LASTING_S
    return {"frames_per_s": frames, "cpu_per_frame_s": share / frames, "lag_s": spread(late)}


def run(arguments: Namespace) -> Iterator[Findings]:
    """Measure the first paint, a quiet screen, one with `RATE` edges a second, a long session."""
    with TemporaryDirectory(prefix="rig-") as name:
        folder, scene = Path(name), arguments.protocol
        figures = serve(folder, partial(_in_terminal, folder, scene)) | _opened(folder, scene)
    yield Findings(figures, text_table(_rows(figures), left={0, 1}), _HEAD, name="terminal")


def _rows(found: dict[str, Any]) -> list[list[str]]:
    first, opened, lag = found["first_paint"], found["opened"], found["lag_s"]
    rest = opened["after_paint"]
    return [
        ["first paint", f"{first['wall_s']:.2f} s, {first['cpu_s']:.2f} s of them computing"],
        [
            f"a session of {opened['runs']} runs, from the command to its results",
            f"{opened['wall_s']:.2f} s, {opened['cpu_s']:.2f} s of them computing",
        ],
        [
            "of these after the first paint",
            f"{rest['wall_s']:.2f} s, {rest['cpu_s']:.2f} s of them computing",
        ],
        ["its report, from kept results", f"{found['report_cpu_s']:.2f} s computing"],
        ["a quiet screen", f"{found['quiet_cpu']:.1%} of a core"],
        [f"{RATE:.0f} edges a second", f"{found['live_cpu']:.1%} of a core"],
        ["frames a second", f"{found['frames_per_s']:.1f}"],
        ["one frame", f"{found['cpu_per_frame_s'] * 1e3:.1f} ms computing"],
        ["lag, median and p99", f"{lag['median'] * 1e3:.0f} ms, {lag['p99'] * 1e3:.0f} ms"],
        ["load of the machine", f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"],
    ]
