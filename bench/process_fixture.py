"""A whole rig of real processes, so that each can be killed: board, daemon and runner."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Self, TypeAlias

from rig.daemon.client import Client, Line
from rig.errors import DeviceError

if TYPE_CHECKING:
    from collections.abc import Iterator

    Process: TypeAlias = subprocess.Popen[str]
    Seen: TypeAlias = dict[str, Any]

FENCE = """\
protocol: 1
title: A picket fence that falls often
chains:
  fence: {rods: 8, length: 350 mm, diameter: 25 mm, position_uncertainty: 0.1 mm}
drop: 400 mm ± 2 mm
gravity: 9.81 m/s^2
gates:
  free: [{channel: 0, height: 50 mm}, {channel: 1, height: 350 mm}]
  height_uncertainty: 0.3 mm
release: {channel: 0, pulse: 80 ms}
plan: {repeats: RUNS, settle: 0.2 s}
accept: {missed_edges: 15 %}
"""
_READY_S = 120.0  # only what never comes takes longer, however busy the machine is
_BOARDS = {
    "sim": ("sim.pty",),
    "emu": ("rig_emulator.hands",),
    "bought": ("rig_emulator.hands", "--loader", "--resets"),
}


class ProcessFixture:
    """Everything in one temporary folder; a context that ends what it started.

    Parameters
    ----------
    runs
        Of the protocol.
    seed
        Of the simulation.
    dials
        As in a ``sim://`` URL.
    board
        ``sim``, ``emu`` for real firmware in an emulator, or ``bought`` for that behind Arduino's
        boot loader and a USB chip that resets it at each opening.
    busy
        Share of bytes that are changed while both directions are under way.
    """

    def __init__(
        self,
        runs: int,
        seed: int = 0,
        dials: dict[str, str] | None = None,
        *,
        board: str = "sim",
        busy: float = 0.0,
    ) -> None:
        self._folder = TemporaryDirectory(prefix="rig-")
        self.folder = Path(self._folder.name)
        self.runs, self.seed, self._dials = runs, seed, dials or {}
        self.protocol = self.folder / "fence.yaml"
        self.protocol.write_text(FENCE.replace("RUNS", str(runs)), "utf-8")
        self.port = self.folder / "port"
        self.socket = self.folder / "door" / "rig.sock"
        self.log = self.folder / "board.jsonl"
        self.session = self.folder / "session"
        self.told = ""  # what the last runner said
        self._kind, self._busy = board, busy
        self._followed = 0  # bytes of the log
        self.board: Process | None = None
        self.daemon: Process | None = None
        self.runner: Process | None = None

    def __enter__(self) -> Self:
        self.board = self._start(
            *("-m", *_BOARDS[self._kind], "--protocol", self.protocol, "--seed", self.seed),
            *("--link", self.port, "--log", self.log, "--busy", self._busy),
            *(f"{name}={value}" for name, value in self._dials.items()),
            stdin=subprocess.PIPE,
        )
        assert self.board.stdout is not None
        if not self.board.stdout.readline():
            _, told = self.board.communicate()
            self.__exit__()
            raise DeviceError(f"the board does not start: {told}")
        return self

    def __exit__(self, *_exc: object) -> None:
        for process in (self.runner, self.daemon, self.board):
            self.kill(process)
        self._folder.cleanup()

    # ------------------------------------------------------------------ processes

    def start_daemon(self, *options: str) -> None:
        """Start a daemon and wait until clients can come."""
        self.daemon = self._start(
            *("-m", "rig", "daemon", "--port", self.port, "--socket", self.socket), *options
        )
        assert self.daemon.stderr is not None
        line = self.daemon.stderr.readline()
        if not line.startswith("rig daemon:"):
            raise DeviceError(f"the daemon does not start: {line}")

    def start_runner(self) -> Process:
        """Start ``rig run`` on the session, through the daemon."""
        self.runner = self._start(
            *("-m", "rig", "run", self.protocol, "--port", self.port, "--session", self.session),
            *("--socket", self.socket, "--yes"),
        )
        return self.runner

    def see_to_runner(self) -> None:
        """Start a runner unless one is still at it."""
        if self.runner is None or self.runner.poll() is not None:
            self.kill(self.runner)
            self.start_runner()

    def run(self) -> int:
        """Have a runner go on with the session to its end; return the exit code."""
        self.see_to_runner()
        return self.waited()

    def waited(self, seconds: float = 600.0) -> int:
        """Wait for the runner's end; return its exit code, and keep what it said in `told`."""
        assert self.runner is not None
        _, self.told = self.runner.communicate(timeout=seconds)
        if "Traceback" in self.told:
            raise AssertionError(self.told)
        return self.runner.returncode

    def kill(self, process: Process | None) -> None:
        """Kill one of the processes, as ``kill -9`` does."""
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout, process.stderr):
                if stream is not None:
                    with suppress(BrokenPipeError):
                        stream.close()

    def fill_disk(self) -> None:
        """Let what is written of the session grow no further, as on a full disk."""
        self._limit_files(max(file.stat().st_size for file in self.folder.glob("session-*")))

    def free_disk(self) -> None:
        """Make room again."""
        self._limit_files(resource.RLIM_INFINITY)

    def _limit_files(self, size: int) -> None:
        assert self.daemon is not None
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    def hand(self, what: str) -> None:
        """Do something at the board, see `sim.pty`."""
        assert self.board is not None
        assert self.board.stdin is not None
        self.board.stdin.write(what + "\n")
        self.board.stdin.flush()

    def client(self, name: str = "a test") -> Client:
        """Connect to the daemon, once it answers."""
        return Client(Line(self.socket, name))

    def _start(self, *arguments: object, stdin: int = subprocess.DEVNULL) -> Process:
        return subprocess.Popen(
            [sys.executable, "-W", "error", *map(str, arguments)],
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        )

    # ------------------------------------------------------------------ what the board saw

    def happened(self) -> Iterator[Seen]:
        """What the board logged so far."""
        for line in self.log.read_text("utf-8").splitlines(keepends=True):
            if line.endswith("\n"):
                yield json.loads(line)

    def follow(self) -> list[Seen]:
        """What the board logged since this was asked last."""
        if self.log.stat().st_size == self._followed:
            return []
        with self.log.open("rb") as file:
            file.seek(self._followed)
            *lines, _ = file.read().split(b"\n")
        self._followed += sum(len(line) + 1 for line in lines)
        return [json.loads(line) for line in lines]

    def await_phase(self, phase: int, count: int = 1) -> float:
        """Wait until the board was in a phase so often; return when, s (monotonic)."""
        until = time.monotonic() + _READY_S
        while time.monotonic() < until:
            found = [seen["at_s"] for seen in self.happened() if seen.get("phase") == phase]
            if len(found) >= count:
                return float(found[count - 1])
            time.sleep(0.005)
        raise TimeoutError(f"the board was not {count} times in phase {phase}")


def processor_s(pid: int) -> float:
    """Processor time a process has had, s."""
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_bytes(process: Process | None, which: str = "VmHWM") -> int:
    """Ask Linux for the most memory a process ever had resident, with ``VmRSS`` for that it has."""
    text = Path(f"/proc/{process.pid if process else 'self'}/status").read_text("ascii")
    return int(text.partition(f"{which}:")[2].split()[0]) * 1024
