"""Falls straight from the simulation, in a process of its own that hands over edges and truths."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from subprocess import PIPE, Popen
from types import MappingProxyType
from typing import Any, NamedTuple
from urllib.parse import quote

from rig.errors import RigError
from rig.records import Drop, Edge

HZ = 16_000_000


class Asked(NamedTuple):
    """Rigs of one simulation by their seeds, and the runs that are made on each."""

    url: str
    seeds: Sequence[int]
    runs: Sequence[Sequence[int]]


class SimulatedDrop(NamedTuple):
    """One drop on the rig of a seed, and what is true of it."""

    seed: int
    drop: Drop
    truth: Mapping[str, Any]

    def rods(self, matches: Mapping[int, int]) -> tuple[int, int]:
        """Count edges given to another rod than they came from, and strays taken for a rod.

        Parameters
        ----------
        matches
            For each edge, by its number in the drop, its rod.
        """
        origins = {number: self.truth["edges"][number][3] for number in matches}
        wrong = sum(origins[n] not in (STRAY, rod) for n, rod in matches.items())
        return wrong, sum(origin == STRAY for origin in origins.values())


STRAY = -1
"""The truth's rod number of what was no rod."""


def falls(asked: Sequence[Asked], module: str = "sim.edges") -> Iterator[SimulatedDrop]:
    """Let the simulation, run as a module, make the drops of one rig after another.

    Parameters
    ----------
    module
        That makes them.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    requests = [
        text
        for url, seeds, runs in asked
        for text in (url, json.dumps([*seeds]), json.dumps([*runs]))
    ]
    command = [sys.executable, "-m", module, *requests]
    with Popen(command, stdout=PIPE, text=True) as simulation:
        assert simulation.stdout is not None
        for line in simulation.stdout:
            record = json.loads(line)
            truth = record["truth"]
            edges = tuple(Edge(round(when * HZ), *rest) for when, *rest in record["edges"])
            drop = Drop(truth["run"], truth["attempt"], HZ, edges)
            yield SimulatedDrop(int(record["seed"]), drop, truth)
    if simulation.returncode:
        urls = ", ".join(request.url for request in asked)
        raise RigError(f"the simulation {urls} ended with exit code {simulation.returncode}")


def simulation(
    protocol: str | Path, settings: Mapping[str, str] = MappingProxyType({}), url: str = "sim://"
) -> str:
    """Return the URL of the simulation of a protocol file, with settings."""
    return with_settings(url, {"protocol": str(Path(protocol).resolve()), **settings})


def with_settings(url: str, settings: Mapping[str, str]) -> str:
    """Add settings to a port's URL."""
    words = "&".join(f"{name}={quote(value)}" for name, value in settings.items())
    return f"{url}{'&' if '?' in url else '?'}{words}"
