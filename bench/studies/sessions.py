"""Simulated sessions, analysed, each drop beside its hidden truth: with a device or without."""

from __future__ import annotations

import json
import re
import time
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from bench.studies.falls import SimulatedDrop, falls
from bench.studies.time_scales import time_scale
from rig.analysis.session import analyze
from rig.errors import InputError
from rig.ports import is_simulated, truth_file
from rig.results.whole import calibration, complete_analysis, protocol_of
from rig.runner import Operator, run_protocol
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from bench.studies.falls import Asked
    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol

SESSION = "simulated.session"


class SimulatedSession(NamedTuple):
    """A session of one rig.

    Attributes
    ----------
    drops
        By run and attempt, each with its time scale.
    wall_s, analysis_s
        Time of the whole, and processor time of the analysis.
    """

    protocol: Protocol
    analysis: Analysis
    drops: Mapping[tuple[int, int], tuple[SimulatedDrop, TimeScale]]
    wall_s: float
    analysis_s: float

    def results(self) -> Iterator[tuple[DropResult, SimulatedDrop, TimeScale]]:
        """Yield each result, of superseded drops too, with its drop and time scale."""
        for result in (*self.analysis.runs, *self.analysis.superseded):
            yield result, *self.drops[result.run.number, result.attempt]


def with_device(
    folder: Path, protocol: str, url: str, seed: int, repeats: int | None = None
) -> SimulatedSession:
    """Run a session through device, line, daemon and file, and analyse it.

    Parameters
    ----------
    folder
        Where its file `SESSION` and the truth beside it are made.
    url
        The simulation, with dials if wanted.
    repeats
        Drops at each incline, where not those of the protocol.

    Raises
    ------
    InputError
        A port that is no simulation has no truth to compare with.
    """
    if not is_simulated(url):
        raise InputError(f"{url} is no simulation", "only a simulation knows the truth: sim://")
    path = folder / SESSION
    source = with_repeats(protocol, repeats, folder) if repeats else protocol
    begin = time.perf_counter()
    run_protocol(source, url, str(path), Operator(lambda _: None), seed)
    wall_s = time.perf_counter() - begin
    lines = truth_file(path).read_text(encoding="utf-8").splitlines()
    truths = {(truth["run"], truth["attempt"]): truth for truth in map(json.loads, lines)}
    with Session.open(path, readonly=True) as session:
        begin = time.process_time()
        analysis, clock = complete_analysis(session), calibration(session)
        analysis_s = time.process_time() - begin
        drops = {
            (drop.run, drop.attempt): (
                SimulatedDrop(seed, drop, truths[drop.run, drop.attempt]), clock.scale(drop)
            )
            for drop in session.drops()
        }  # fmt: skip
        return SimulatedSession(protocol_of(session), analysis, drops, wall_s, analysis_s)


def without_device(
    requests: Sequence[tuple[Protocol, Asked]], module: str = "sim.edges"
) -> Iterator[SimulatedSession]:
    """Let chains fall straight from the simulation into the analysis: a session a rig.

    Parameters
    ----------
    requests
        Simulations with the protocols that their rigs state.
    module
        Of the simulation, see `bench.studies.falls.falls`.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    drops = falls([asked for _, asked in requests], module)
    for protocol, asked in requests:
        for seed, runs in zip(asked.seeds, asked.runs, strict=True):
            begin = time.perf_counter()
            yield _session(protocol, seed, [*islice(drops, len(runs))], begin)


def _session(
    protocol: Protocol, seed: int, made: Sequence[SimulatedDrop], begin: float
) -> SimulatedSession:
    scale, start = time_scale(seed), time.process_time()
    analysis = analyze(protocol, [fall.drop for fall in made], lambda _: scale)
    analysis_s = time.process_time() - start
    drops = {(fall.drop.run, fall.drop.attempt): (fall, scale) for fall in made}
    return SimulatedSession(protocol, analysis, drops, time.perf_counter() - begin, analysis_s)


def with_repeats(protocol: str, repeats: int, folder: Path) -> str:
    """Write the protocol again with another number of drops at each incline."""
    text = Path(protocol).read_text(encoding="utf-8")
    changed, n = re.subn(r"(\brepeats:\s*)\d+", rf"\g<1>{repeats}", text)
    if n != 1:
        raise InputError(f"{protocol}: the plan says {n} times how many repeats", "write it once")
    copy = folder / "repeated.yaml"
    copy.write_text(changed, encoding="utf-8")
    return str(copy)
