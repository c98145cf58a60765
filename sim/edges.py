"""Falls without a device: edges as a perfect recorder would keep them, and their hidden truth.

``python -m sim.edges URL SEEDS RUNS …`` prints one line of JSON a drop, of one simulation after the
other. Benchmarks that need thousands of falls ask here; everything that a board, a line and a host
do to edges is left out.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, NamedTuple

from rig.link.messages import pack_label
from rig.ports import read_settings
from rig.protocol import reader
from sim.dials import read_dials
from sim.scene import choose_world

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from sim.lab import ChainLab
    from sim.scene import World
    from sim.truth import Truth

TOGETHER = 80
"""Drops that are made at once, at most; more would take little less time each, but much memory."""


class Request(NamedTuple):
    """A simulation's URL, the seeds of its rigs, and the runs that are made on each."""

    url: str
    seeds: list[int]
    runs: list[list[int]]


def falls(asked: Iterable[Request]) -> Iterator[str]:
    """Let chains fall, of one simulation after the other.

    Yields
    ------
    str
        ``{"seed", "edges": [[seconds, channel, blocked], …], "truth": {…}}``.
    """
    together: list[_Rig] = []
    for rig in (rig for one in asked for rig in _rigs(one)):
        drops = sum(len(one.labels) for one in together)
        other = bool(together) and rig.world.make_ahead is not together[0].world.make_ahead
        if together and (other or drops + len(rig.labels) > TOGETHER):
            yield from _drops(together)
            together = []
        together.append(rig)
    yield from _drops(together)


class _Rig(NamedTuple):
    seed: int
    world: World
    lab: ChainLab
    labels: list[int]
    told: list[Truth]


def _rigs(asked: Request) -> Iterator[_Rig]:
    settings = read_settings(asked.url)
    protocol = reader.read(settings.pop("protocol"))
    world, settings = choose_world(settings)
    dials = read_dials(settings)
    for seed, numbers in zip(asked.seeds, asked.runs, strict=True):
        told: list[Truth] = []
        lab = world.hang(protocol, dials, seed, told.append)
        yield _Rig(seed, world, lab, [pack_label(number, 1) for number in numbers], told)


def _drops(rigs: Sequence[_Rig]) -> Iterator[str]:
    if rigs:
        rigs[0].world.make_ahead([(rig.lab, rig.labels) for rig in rigs])
    for rig in rigs:
        for label in rig.labels:
            edges = rig.lab.drop(label)
            yield json.dumps({"seed": rig.seed, "edges": edges, "truth": asdict(rig.told.pop())})


if __name__ == "__main__":
    words = iter(sys.argv[1:])
    triples = zip(words, words, words, strict=True)
    for line in falls(Request(u, json.loads(s), json.loads(r)) for u, s, r in triples):
        print(line)
