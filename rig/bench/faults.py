"""Sessions made while somebody kills, pulls, resets and fills disks: what was lost, counted."""

from __future__ import annotations

import random
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING

from rig.bench.crowd import deaf, raced
from rig.bench.invariants import broken, longest_on
from rig.bench.moments import fell_upon, off_after, reach
from rig.bench.stand import Stand
from rig.bench.tally import Tally
from rig.errors import DeviceError, SessionError
from rig.link.transcript import Transcript
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable

KINDS = ("daemon", "runner", "cable", "reset", "disk")
"""What can be disturbed: processes killed, the cable pulled for a moment, the board reset, the
disk filled for a moment."""
CROWD = {"race": raced, "deaf": deaf}
"""What clients can do to each other: two that want control at once, some that never read."""
NOISE = {"corrupt": "0.01", "lose": "0.005"}
"""Of each byte, in both directions."""
OFF_S = 0.25
"""Within this time after whatever happened, nothing is armed or on any more."""
_RUNS = 6  # in a session
_TRIES = 40  # of a runner that finds the link down
_TROUBLE_S = 3.0  # in which a runner sees the trouble, or is done with its work
_DISK_FULL_S = 1.0
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
) -> Tally:
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
        ``sim``, or ``emu`` for real firmware in an emulator.
    """
    tally, chance = Tally(), random.Random(f"{kind} {seed}")  # noqa: S311 - moments, not secrets
    accept = _FULL if kind == "disk" else _DOWN
    while not tally.sessions or tally.disturbed < count:
        with Stand(
            runs, seed + tally.sessions, dials, board=board, small_disk=kind == "disk"
        ) as stand:
            stand.start_daemon()
            tally.full_disk = stand.disk.how if stand.disk else ""
            moments = []
            while tally.disturbed < count:
                stand.see_to_runner()
                if not reach(stand, chance, accept):
                    break
                tally.disturbed += 1
                moments.append(time.monotonic())
                _disturb(stand, kind, chance)
                tally.broken += _unreadable(stand)
                tally.fell_upon[fell_upon(stand, moments[-1])] += 1
            _finish(stand)
            _look(stand, moments, tally)
    return tally


def _disturb(stand: Stand, kind: str, chance: random.Random) -> None:
    if kind == "daemon":
        stand.kill(stand.daemon)
        stand.waited()
        stand.start_daemon()
        return
    if kind == "runner":
        stand.kill(stand.runner)
        return
    if kind == "cable":
        stand.hand(f"pull {chance.uniform(0.02, 0.6):.3f}")
    elif kind == "reset":
        stand.hand("reset")
    elif kind == "disk":
        assert stand.disk is not None
        stand.disk.fill(stand.daemon)
        time.sleep(chance.uniform(0.1, _DISK_FULL_S))
        stand.disk.free(stand.daemon)
    else:
        raise ValueError(kind)
    with suppress(subprocess.TimeoutExpired):
        stand.waited(_TROUBLE_S)


def _unreadable(stand: Stand) -> list[str]:
    if stand.session.exists():
        try:
            with Session.open(stand.session, readonly=True) as session:
                list(session.drops())
        except Exception as error:
            return [f"unreadable: {error}"]
    return []


def _finish(stand: Stand) -> None:
    for _ in range(_TRIES):
        if stand.run() == 0:
            return
        time.sleep(0.2)
    raise DeviceError(f"the session does not end: {stand.told}")


def _look(stand: Stand, moments: list[float], tally: Tally) -> None:
    """See what a finished session has, and whether every promise was kept."""
    happened = list(stand.happened())
    tally.broken += broken(stand.session, happened, stand.runs)
    tally.longest_on_s = max(tally.longest_on_s, longest_on(happened))
    tally.off_after_s = max(tally.off_after_s, *(off_after(happened, at) for at in moments), 0.0)
    if tally.longest_on_s > OFF_S:
        tally.broken.append("the release was on too long")
    tally.sessions += 1
    tally.runs += stand.runs
    transcript = Transcript()
    with Session.open(stand.session, readonly=True) as session:
        tally.drops += sum(1 for _ in session.drops())
        for host_ns, direction, data in session.byte_log():
            transcript.feed(direction, host_ns, data)
    tally.frames += transcript.good_frames + transcript.bad_frames
    tally.bad_frames += transcript.bad_frames


def faults(
    counts: dict[str, int], jobs: int, say: Callable[[str], None], board: str = "sim"
) -> dict[str, Tally]:
    """Disturb everything, and make sessions on a bad line too.

    Parameters
    ----------
    counts
        Disturbances by kind; ``noise`` counts sessions.
    jobs
        Rigs side by side: most of the time they wait.
    say
        Narration.
    board
        As for `disturbed`.
    """
    found: dict[str, Tally] = {}
    with ThreadPoolExecutor(jobs) as pool:
        work = {
            kind: [
                pool.submit(_some, kind, part, 100 * n + 1, board)
                for n, part in enumerate(_shares(kind, count, jobs))
            ]
            for kind, count in counts.items()
        }
        for kind, parts in work.items():
            found[kind] = Tally()
            for part in parts:
                found[kind].add(part.result())
            # Here only, where the machine has nothing else to do: the daemon may be late too.
            if found[kind].off_after_s > OFF_S:
                found[kind].broken.append("something stayed armed or on after a disturbance")
            say(f"{board} {kind}: {found[kind].json()}")
    return found


def _shares(kind: str, count: int, jobs: int) -> list[int]:
    if kind == "noise":
        return [1] * count
    return [part for n in range(jobs) if (part := count // jobs + (n < count % jobs))]


def _some(kind: str, count: int, seed: int, board: str) -> Tally:
    try:
        if kind in CROWD:
            return CROWD[kind](count, seed, board)
        if kind == "noise":
            return disturbed("daemon", 0, seed, dials=NOISE, board=board)
        return disturbed(kind, count, seed, board=board)
    except Exception as error:
        return Tally(broken=[f"given up: {error!r}"])
