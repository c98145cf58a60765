"""Which run comes next, by the rules of the headless runner."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from rig.tui.state import RunLine

SETTLED = ("accepted", "marginal", "rejected")


class Job(NamedTuple):
    """One attempt at one run."""

    run: int
    attempt: int


def next_job(runs: Sequence[RunLine], voids: Mapping[int, int]) -> Job | None:
    """Name the next attempt of the plan; `None` when it is done.

    Parameters
    ----------
    runs
        The plan, in order.
    voids
        How many attempts at each run were void.
    """
    return next((_again(line) for line in runs if not done(line, voids.get(line.run, 0))), None)


def done(line: RunLine, voids: int) -> bool:
    """Whether a run is done with: settled, or void too often."""
    from rig.protocol.plan import ATTEMPTS  # noqa: PLC0415 - not before the first paint

    return line.state in SETTLED or voids >= ATTEMPTS


def again(runs: Sequence[RunLine], run: int) -> Job | None:
    """Name another attempt at a run, whatever became of it; `None` when it is not planned."""
    return next((_again(line) for line in runs if line.run == run), None)


def unjudged(runs: Sequence[RunLine]) -> Job | None:
    """Name a drop that was recorded and never judged."""
    return next((Job(line.run, line.attempt) for line in runs if line.state == "recorded"), None)


def _again(line: RunLine) -> Job:
    return Job(line.run, line.attempt + 1)


def void_counts(known: Iterable[Job], runs: Sequence[RunLine]) -> Mapping[int, int]:
    """Count void attempts at each run: those in the file, and those heard of since it was read."""
    heard = {Job(line.run, line.attempt) for line in runs if line.state == "void"}
    return Counter(job.run for job in {*known, *heard})
