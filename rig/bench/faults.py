"""Sessions made while somebody kills, pulls and resets: what was lost, counted."""

from __future__ import annotations

import random
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rig.bench.invariants import broken, longest_on
from rig.bench.stand import Stand
from rig.errors import DeviceError
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable

KINDS = ("daemon", "runner", "cable", "reset")
"""What can be disturbed: processes killed, the cable pulled for a moment, the board reset."""
NOISE = {"corrupt": "0.01", "lose": "0.005"}
"""Of each byte, in both directions."""
_RUNS = 6  # in a session
_LONGEST_S = 7.0  # between two disturbances
_TRIES = 40  # of a runner that finds the link down


@dataclass(slots=True)
class Tally:
    """What happened.

    Attributes
    ----------
    disturbed
        How often.
    sessions, runs, drops
        Finished, done, and recorded (an attempt more for each that was spoiled).
    longest_on_s
        The longest time the release was on.
    broken
        Invariants that did not hold, see `rig.bench.invariants.broken`.
    """

    disturbed: int = 0
    sessions: int = 0
    runs: int = 0
    drops: int = 0
    longest_on_s: float = 0.0
    broken: list[str] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Take another tally's counts."""
        self.disturbed += other.disturbed
        self.sessions += other.sessions
        self.runs += other.runs
        self.drops += other.drops
        self.longest_on_s = max(self.longest_on_s, other.longest_on_s)
        self.broken += other.broken

    def json(self) -> dict[str, Any]:
        """Counts by name."""
        return {name: getattr(self, name) for name in self.__slots__}


def disturbed(
    kind: str,
    count: int,
    seed: int,
    *,
    runs: int = _RUNS,
    longest_s: float = _LONGEST_S,
    dials: dict[str, str] | None = None,
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
    longest_s
        Between two disturbances.
    dials
        Of the simulation, such as `NOISE`.
    """
    tally, moments = Tally(), random.Random(f"{kind} {seed}")  # noqa: S311 - moments, not secrets
    while not tally.sessions or tally.disturbed < count:
        with Stand(runs, seed + tally.sessions, dials) as stand:
            stand.start_daemon()
            while tally.disturbed < count:
                stand.start_runner()
                if _left_alone(stand, moments.uniform(0.0, longest_s)):
                    break
                tally.disturbed += 1
                _disturb(stand, kind)
                _check_readable(stand, tally)
            _finish(stand, tally)
    return tally


def _left_alone(stand: Stand, seconds: float) -> bool:
    """Let the runner run; whether the session is finished."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        assert stand.runner is not None
        try:
            _, stand.told = stand.runner.communicate(timeout=left)
        except subprocess.TimeoutExpired:
            return False
        if stand.runner.returncode == 0:
            return True
        if stand.runner.returncode != 4:
            raise AssertionError(stand.told)
        time.sleep(0.1)  # the link is down, and the runner has said so
        stand.start_runner()
    return False


def _disturb(stand: Stand, kind: str) -> None:
    if kind == "daemon":
        stand.kill(stand.daemon)
        assert stand.runner is not None
        stand.runner.communicate(timeout=30)
        stand.start_daemon()
        return
    if kind == "cable":
        stand.hand("pull 0.3")
    elif kind == "reset":
        stand.hand("reset")
    elif kind == "runner":
        stand.kill(stand.runner)
        return
    else:
        raise ValueError(kind)
    assert stand.runner is not None
    stand.runner.communicate(timeout=120)  # it sees the trouble, or is done with its work


def _check_readable(stand: Stand, tally: Tally) -> None:
    if stand.session.exists():
        try:
            with Session.open(stand.session, readonly=True) as session:
                list(session.drops())
        except Exception as error:
            tally.broken.append(f"unreadable: {error}")


def _finish(stand: Stand, tally: Tally) -> None:
    for _ in range(_TRIES):
        if stand.run() == 0:
            break
        time.sleep(0.2)
    else:
        raise DeviceError(f"the session does not end: {stand.told}")
    happened = list(stand.happened())
    tally.broken += broken(stand.session, happened, stand.runs)
    tally.longest_on_s = max(tally.longest_on_s, longest_on(happened))
    tally.sessions += 1
    tally.runs += stand.runs
    with Session.open(stand.session, readonly=True) as session:
        tally.drops += sum(1 for _ in session.drops())


def faults(counts: dict[str, int], jobs: int, say: Callable[[str], None]) -> dict[str, Tally]:
    """Disturb everything, and make sessions on a bad line too.

    Parameters
    ----------
    counts
        Disturbances by kind; ``noise`` counts sessions.
    jobs
        Rigs side by side: most of the time they wait.
    say
        Narration.
    """
    found: dict[str, Tally] = {}
    with ThreadPoolExecutor(jobs) as pool:
        for kind, count in counts.items():
            noisy = kind == "noise"
            share = [count // jobs + (n < count % jobs) for n in range(jobs)]
            if noisy:
                share = [1] * count
            work = [
                pool.submit(
                    disturbed, "daemon" if noisy else kind, 0 if noisy else part, 100 * n + 1,
                    dials=NOISE if noisy else None,
                )
                for n, part in enumerate(share) if part
            ]  # fmt: skip
            found[kind] = Tally()
            for one in work:
                found[kind].add(one.result())
            say(f"{kind}: {found[kind].json()}")
    return found
