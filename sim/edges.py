"""Falls without a device: edges as a perfect recorder would keep them, and their hidden truth.

``python -m sim.edges URL SEEDS RUNS …`` prints one line of JSON a drop, of one simulation after the
other. Benchmarks that need thousands of falls ask here; everything that a board, a line and a host
do to edges is left out.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import TYPE_CHECKING

from rig.link.messages import pack_label
from rig.ports import read_settings
from rig.protocol import reader
from sim.dials import read_dials
from sim.lab import ChainLab

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sim.truth import Truth


def falls(url: str, seeds: list[int], runs: list[list[int]]) -> Iterator[str]:
    """Let chains fall.

    Parameters
    ----------
    url
        ``sim://?protocol=FILE``, with dials if wanted.
    seeds
        Of the rigs.
    runs
        Numbers of the planned runs that are made on each.

    Yields
    ------
    str
        ``{"seed", "edges": [[seconds, channel, blocked], …], "truth": {…}}``.
    """
    settings = read_settings(url)
    protocol = reader.read(settings.pop("protocol"))
    dials = read_dials(settings)
    told: list[Truth] = []
    for seed, numbers in zip(seeds, runs, strict=True):
        lab = ChainLab(protocol, dials, seed, told.append)
        for number in numbers:
            edges = lab.drop(pack_label(number, 1))
            yield json.dumps({"seed": seed, "edges": edges, "truth": asdict(told.pop())})


if __name__ == "__main__":
    asked = iter(sys.argv[1:])
    for url, seeds, runs in zip(asked, asked, asked, strict=True):
        for line in falls(url, json.loads(seeds), json.loads(runs)):
            print(line)
