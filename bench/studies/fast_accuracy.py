"""Accuracy over many rigs: falls straight from the simulation into the analysis, without a device.

Drops on one rig share errors, so many rigs with few drops each tell most about intervals. What is
true goes to the tally alone.
"""

from __future__ import annotations

import time
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.studies.accuracy import AccuracyTally
from rig.analysis.session import analyze
from rig.bench.falls import Asked, falls, time_scale, with_setting
from rig.protocol import reader
from rig.protocol.plan import runs

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rig.bench.falls import SimulatedDrop
    from rig.protocol.protocol import Protocol

BLOCK = 4
"""Drops in a block: A, B, B, A."""
DOUBLED = {
    "skew_sd": "4 ms",
    "delay_sd": "2 ms",
    "hang_sd": "0.2 mm",
    "drop_error": "1",
    "rod_sd": "0.6 mm",
    "width_sd": "0.2 mm",
    "gate_sd": "0.4 mm",
    "datum_sd": "0.4 mm",
    "beam_sd": "1 mm",
    "impulse_sd": "0.04",
    "jitter_sd": "4 us",
    "missed": "2 %",
    "chatter": "1 %",
    "string": "0.4 %",
    "bounce": "10 %",
    "clock": "-2600 ppm",
    "latency": "0.6 ms",
}
"""Dials of the simulated rig at twice their default, as a port's URL takes them."""
STACK = ("clock", "latency")
"""Dials that only show where a board and a line stand between the chains and the analysis."""


def fast_accuracy(protocol: str, url: str, rigs: int) -> dict[str, Any]:
    """Simulate and analyse one short session on each of many rigs: one block of drops.

    Parameters
    ----------
    protocol
        The protocol file.
    url
        ``sim://``, with dials if wanted. Those of the clock and the line change nothing here.
    rigs
        How many, with `BLOCK` drops each.

    Returns
    -------
    dict
        As `bench.studies.accuracy.AccuracyTally.json` gives it.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    scene = reader.read(protocol)
    tally = AccuracyTally()
    source = with_setting(url, "protocol", str(Path(protocol).resolve()))
    asked = Asked(source, range(1, rigs + 1), blocks(scene, rigs))
    for seed, told in groupby(falls([asked]), key=attrgetter("seed")):
        begin = time.perf_counter()
        _session(scene, seed, told, tally)
        tally.seconds.append(time.perf_counter() - begin)
    return tally.json()


def blocks(protocol: Protocol, rigs: int) -> list[list[int]]:
    """Choose the runs of each rig: a whole block, and over the rigs all of the plan's alike."""
    by_incline: dict[float, list[int]] = {}
    for run in runs(protocol):
        by_incline.setdefault(run.incline_deg, []).append(run.number)
    most = max(map(len, by_incline.values()))
    blocks = [
        numbers[first : first + BLOCK]
        for first in range(0, most, BLOCK)
        for numbers in by_incline.values()
        if numbers[first : first + BLOCK]
    ]
    return [blocks[rig % len(blocks)] for rig in range(rigs)]


def _session(
    protocol: Protocol, seed: int, told: Iterable[SimulatedDrop], tally: AccuracyTally
) -> None:
    """Analyse one rig's drops and judge the results."""
    scale = time_scale(seed)
    by_key = {(fall.drop.run, fall.drop.attempt): fall for fall in told}
    begin = time.process_time()
    found = analyze(protocol, [fall.drop for fall in by_key.values()], lambda _: scale)
    tally.analysis_s += time.process_time() - begin
    for result in (*found.runs, *found.superseded):
        fall = by_key[result.run.number, result.attempt]
        tally.add(protocol, result, fall.drop, scale.hz, fall.truth)


def doubled(url: str, dial: str) -> str:
    """Set one dial in a port's URL."""
    return with_setting(url, dial, DOUBLED[dial])
