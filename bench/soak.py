"""Long sessions in virtual time: runs without end, and days on which nothing happens."""

from __future__ import annotations

import resource
import time
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from bench.process_fixture import FENCE
from rig.bench.findings import Findings
from rig.recorder.controller import Controller
from rig.replay import replay
from rig.session.schema import RunState
from rig.session.store import Session
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_PLANNED = 1000
"""Runs of one plan; longer soaks take sessions one after another."""
_HOUR_S = 3600.0


def run(arguments: Namespace) -> Iterator[Findings]:
    """Soak; it has failed when anything is missing or altered."""
    with TemporaryDirectory(prefix="rig-soak-") as place:
        counts = soaked(Path(place), arguments.runs, arguments.hours)
    lines = text_table([[name, f"{value:g}"] for name, value in counts.items()])
    yield Findings(counts, lines, failed=counts["drops"] != arguments.runs or counts["faults"] > 0)


def soaked(folder: Path, runs: int, hours: float) -> dict[str, float]:
    """Record so many runs and be idle for so many hours of virtual time, and look at what is there.

    Parameters
    ----------
    folder
        For the sessions.
    runs
        In all.
    hours
        Of nothing but clock samples, between the runs of the last session.

    Returns
    -------
    dict of str to float
        Counts, and what it took.
    """
    found = dict.fromkeys(("drops", "faults", "ticks wrapped", "clock samples", "file MB"), 0.0)
    began, before = time.monotonic(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    left = runs
    while left > 0:
        some = min(left, _PLANNED)
        left -= some
        session = folder / f"session-{left}"
        _record(folder, session, some, 0.0 if left else hours)
        found["file MB"] = max(found["file MB"], session.stat().st_size / 1e6)
        with Session.open(session, readonly=True) as opened:
            drops = list(opened.drops())
            found["drops"] += len(drops)
            found["faults"] += sum(len(drop.faults) for drop in drops)
            ticks = [ping.tick for ping in opened.pings()]
            found["clock samples"] += len(ticks)
            found["ticks wrapped"] += sum(b < a for a, b in pairwise(ticks))
            found["faults"] += len(replay(opened).differences)
        session.unlink()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return found | {"memory grown by MB": memory / 1e3, "seconds": time.monotonic() - began}


def _record(folder: Path, session: Path, runs: int, hours: float) -> None:
    protocol = folder / "fence.yaml"
    protocol.write_text(FENCE.replace("RUNS", str(runs)), "utf-8")
    rig = Controller("sim://")
    try:
        rig.open_session(str(protocol), str(session), 3)
        for run in range(1, runs + 1):
            rig.wait(hours * _HOUR_S / runs)
            rig.fire(rig.arm(run, 1))
            rig.collect(run, 1)
            rig.log_state(run, 1, RunState.ACCEPTED)
    finally:
        rig.close()
