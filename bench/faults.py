"""Sessions made while somebody kills, pulls, resets and fills disks: what was lost, counted."""

from __future__ import annotations

import random
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING

from bench.contention import deaf, raced
from bench.moments import STATES, fell_upon, off_after, reach
from bench.process_fixture import ProcessFixture
from bench.tally import FaultTally
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.errors import DeviceError, SessionError
from rig.link.transcript import Transcript
from rig.session.store import Session
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

KINDS = ("daemon", "runner", "cable", "reset", "brownout", "disk")
"""What can be disturbed: processes killed, the cable pulled for a moment, the board reset, its
supply's voltage sunk, the disk filled for a moment."""
CONTENTION = {"race": raced, "deaf": deaf}
"""What clients can do to each other: two that want control at once, some that never read."""
NOISE = {"corrupt": "0.01", "lose": "0.005"}
"""Of each byte, in both directions."""
BUSY = 0.5
"""Of each byte while both directions are under way: some USB chips do so from 230,400 baud."""
OFF_S = 0.25
"""Within this time after whatever happened, nothing is armed or on any more."""
_RUNS = 6  # in a session
_TRIES = 40  # of a runner that finds the link down
_TROUBLE_S = 3.0  # in which a runner sees the trouble, or is done with its work
_DISK_FULL_S = 1.0
_COUNTS = {
    "sim": {"daemon": 200, "runner": 50, "cable": 100, "reset": 40, "brownout": 40, "disk": 40,
            "noise": 8, "busy": 4, "race": 10, "deaf": 4},
    # The emulator takes a good part of a core for each rig.
    "emu": {"daemon": 40, "runner": 10, "cable": 20, "reset": 10, "brownout": 10, "noise": 2},
    "bought": {"daemon": 10, "cable": 10, "reset": 5, "brownout": 10, "noise": 1, "busy": 1},
}  # fmt: skip
_DOWN = (0, DeviceError.exit_code)
_FULL = (*_DOWN, SessionError.exit_code)


def disturbed(
    kind: str,
    count: int,
    seed: int,
    *,
    runs: int = _RUNS,
    dials: dict[str, str] | None = None,
    board: str = "sim",
    busy: float = 0.0,
) -> FaultTally:
    """Make sessions, with so many disturbances at random moments.

    Parameters
    ----------
    kind
        One of `KINDS`.
    count
        Disturbances; 0 for one session in peace.
    seed
        Chooses moments and simulation.
    runs
        In each session.
    dials
        Of the simulation, such as `NOISE`.
    board
        ``sim``, ``emu`` or ``bought``, see `ProcessFixture`.
    busy
        See there, too.
    """
    tally, chance = FaultTally(), random.Random(f"{kind} {seed}")
    accept = _FULL if kind == "disk" else _DOWN
    while not tally.sessions or tally.disturbed < count:
        with ProcessFixture(
            runs, seed + tally.sessions, dials, board=board, busy=busy
        ) as processes:
            processes.start_daemon()
            moments = []
            while tally.disturbed < count:
                processes.see_to_runner()
                if not reach(processes, chance, accept):
                    break
                tally.disturbed += 1
                moments.append(time.monotonic())
                _disturb(processes, kind, chance)
                tally.broken += _unreadable(processes)
                tally.fell_upon[fell_upon(processes, moments[-1])] += 1
            _finish(processes)
            _look(processes, moments, tally)
    return tally


def _disturb(processes: ProcessFixture, kind: str, chance: random.Random) -> None:
    if kind == "daemon":
        processes.kill(processes.daemon)
        processes.waited()
        processes.start_daemon()
        return
    if kind == "runner":
        processes.kill(processes.runner)
        return
    if kind == "cable":
        processes.hand(f"pull {chance.uniform(0.02, 0.6):.3f}")
    elif kind in {"reset", "brownout"}:
        processes.hand(kind)
    elif kind == "disk":
        processes.fill_disk()
        time.sleep(chance.uniform(0.1, _DISK_FULL_S))
        processes.free_disk()
    else:
        raise ValueError(kind)
    with suppress(subprocess.TimeoutExpired):
        processes.waited(_TROUBLE_S)


def _unreadable(processes: ProcessFixture) -> list[str]:
    if processes.session.exists():
        try:
            with Session.open(processes.session, readonly=True) as session:
                list(session.drops())
        except Exception as error:
            return [f"unreadable: {error}"]
    return []


def _finish(processes: ProcessFixture) -> None:
    for _ in range(_TRIES):
        if processes.run() == 0:
            return
        time.sleep(0.2)
    raise DeviceError(f"the session does not end: {processes.told}")


def _look(processes: ProcessFixture, moments: list[float], tally: FaultTally) -> None:
    """See what a finished session has, and whether every promise was kept."""
    happened = tally.add_session(processes)
    tally.off_after_s = max(tally.off_after_s, *(off_after(happened, at) for at in moments), 0.0)
    if tally.longest_on_s > OFF_S:
        tally.broken.append("the release was on too long")
    transcript = Transcript()
    with Session.open(processes.session, readonly=True) as session:
        for host_ns, direction, data in session.byte_log():
            transcript.feed(direction, host_ns, data)
    tally.frames += transcript.rx.good + transcript.rx.bad
    tally.bad_frames += transcript.rx.bad


def faults(counts: dict[str, int], jobs: int, board: str = "sim") -> dict[str, FaultTally]:
    """Disturb everything, and make sessions on a bad line too.

    Parameters
    ----------
    counts
        Disturbances by kind; ``noise`` and ``busy`` count sessions.
    jobs
        Rigs side by side: most of the time they wait.
    board
        As for `disturbed`.
    """
    tallies: dict[str, FaultTally] = {}
    with ThreadPoolExecutor(jobs) as pool:
        work = {
            kind: [
                pool.submit(_some, kind, part, 100 * n + 1, board)
                for n, part in enumerate(_shares(kind, count, jobs))
            ]
            for kind, count in counts.items()
        }
        for kind, parts in work.items():
            tally = tallies[kind] = FaultTally()
            for part in parts:
                tally.add(part.result())
            # Here only, where the machine has nothing else to do: the daemon may be late too.
            if tally.off_after_s > OFF_S:
                tally.broken.append("something stayed armed or on after a disturbance")
            say(f"{board} {kind}: {tally.json()}")
    return tallies


def _shares(kind: str, count: int, jobs: int) -> list[int]:
    if kind in {"noise", "busy"}:
        return [1] * count
    return [part for n in range(jobs) if (part := count // jobs + (n < count % jobs))]


def _some(kind: str, count: int, seed: int, board: str) -> FaultTally:
    try:
        if kind in CONTENTION:
            return CONTENTION[kind](count, seed, board)
        if kind == "noise":
            return disturbed("daemon", 0, seed, dials=NOISE, board=board)
        if kind == "busy":
            return disturbed("daemon", 0, seed, board=board, busy=BUSY)
        return disturbed(kind, count, seed, board=board)
    except Exception as error:
        return FaultTally(broken=[f"given up: {error!r}"])


def run(arguments: Namespace) -> Iterator[Findings]:
    """Kill, pull, reset, fill and garble, and count what was lost."""
    tallies: dict[str, dict[str, FaultTally]] = {}
    for board in arguments.boards:
        if board != "sim" and find_spec("rig_emulator") is None:
            say(f"left out: {board} (pip install ./firmware/emulator)")
            continue
        counts = {
            kind: max(1, round(count * arguments.share / 100))
            for kind, count in _COUNTS[board].items()
            if kind in (arguments.kinds or _COUNTS[board])
        }
        if counts:  # not every kind is done to each board
            tallies[board] = faults(counts, arguments.jobs, board)
    troubles = [
        f"{board} {kind}: {trouble}"
        for board, kinds in tallies.items()
        for kind, tally in kinds.items()
        for trouble in tally.broken
    ]
    for trouble in troubles:
        say(trouble)
    record = {
        board: {kind: tally.json() for kind, tally in kinds.items()}
        for board, kinds in tallies.items()
    }
    lines = [line for board, kinds in tallies.items() for line in _lines(board, kinds)]
    yield Findings(record, lines, failed=bool(troubles))


def _lines(board: str, kinds: dict[str, FaultTally]) -> Iterator[str]:
    names = ("times", *STATES, "sessions", "runs", "drops", "bad frames", "on ms", "off ms", "lost")
    rows = [[board, *names]]
    for kind, tally in kinds.items():
        share = f"{tally.bad_frames / max(1, tally.frames):.1%}"
        counts = (tally.disturbed, *(tally.fell_upon[state] for state in STATES), tally.sessions,
                  tally.runs, tally.drops)  # fmt: skip
        ends = (round(tally.longest_on_s * 1e3), round(tally.off_after_s * 1e3), len(tally.broken))
        rows.append([kind, *map(str, counts), share, *map(str, ends)])
    yield from text_table(rows, left={0})
    if "deaf" in kinds:
        yield f"a daemon nobody read from grew by {kinds['deaf'].memory_bytes / 1e6:.1f} MB"
