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

from .dials import read_dials
from .scene import hang_chains

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .lab import ChainLab
    from .truth import Truth

    Hang = Callable[..., ChainLab]


def falls(url: str, seeds: list[int], runs: list[list[int]], hang: Hang) -> Iterator[str]:
    """Let chains fall, of one simulation after the other.

    Parameters
    ----------
    url
        The simulation's.
    seeds, runs
        Of its rigs, and of each rig the runs that are made on it.
    hang
        Hangs a protocol's chains, given dials, seed, and whom to tell the truth.

    Yields
    ------
    str
        ``{"seed", "edges": [[seconds, channel, blocked], …], "truth": {…}}``.
    """
    settings = read_settings(url)
    protocol = reader.read(settings.pop("protocol"))
    dials = read_dials(settings)
    for seed, numbers in zip(seeds, runs, strict=True):
        truths: list[Truth] = []
        lab = hang(protocol, dials, seed, truths.append)
        labels = [pack_label(number, 1) for number in numbers]
        lab.make_ahead(labels)
        for label in labels:
            edges = lab.drop(label)
            yield json.dumps({"seed": seed, "edges": edges, "truth": asdict(truths.pop())})


def main(hang: Hang = hang_chains) -> None:
    """Print the drops that the command line asks for."""
    words = iter(sys.argv[1:])
    for url, seeds, runs in zip(words, words, words, strict=True):
        for line in falls(url, json.loads(seeds), json.loads(runs), hang):
            print(line)


if __name__ == "__main__":
    main()
