"""Falls without a device: edges as a perfect recorder would keep them, and their hidden truth.

``python -m sim.edges URL SEEDS RUNS …`` prints one line of JSON a drop, of one simulation after the
other. Benchmarks that need thousands of falls ask here; everything that a board, a line and a host
do to edges is left out.
"""

from __future__ import annotations

import itertools
import json
import sys
from dataclasses import asdict
from typing import TYPE_CHECKING

from rig.link.messages import pack_label
from rig.ports import read_settings
from rig.protocol import reader
from sim.dials import read_dials
from sim.scene import choose_world

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sim.truth import Truth

RIGS = 16


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
    world, settings = choose_world(settings)
    dials = read_dials(settings)
    told: list[Truth] = []
    rigs = zip(seeds, runs, strict=True)
    # So many rigs at a time that their falls together are made at little cost each.
    while some := list(itertools.islice(rigs, RIGS)):
        labs = [
            (world.hang(protocol, dials, seed, told.append), [pack_label(n, 1) for n in numbers])
            for seed, numbers in some
        ]
        world.make_ahead(labs)
        for (seed, _), (lab, labels) in zip(some, labs, strict=True):
            for label in labels:
                edges = lab.drop(label)
                yield json.dumps({"seed": seed, "edges": edges, "truth": asdict(told.pop())})


if __name__ == "__main__":
    asked = iter(sys.argv[1:])
    for url, seeds, runs in zip(asked, asked, asked, strict=True):
        for line in falls(url, json.loads(seeds), json.loads(runs)):
            print(line)
