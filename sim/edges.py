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

from .dials import read_dials
from .scene import choose_world

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from .scene import Hang
    from .truth import Truth

    Choose = Callable[[dict[str, str]], tuple[Hang, dict[str, str]]]


class Request(NamedTuple):
    """A simulation's URL, the seeds of its rigs, and the runs that are made on each.

    With ``film=1`` in the URL truths have films, see `rig.films`.
    """

    url: str
    seeds: list[int]
    runs: list[list[int]]


def falls(asked: Iterable[Request], choose: Choose = choose_world) -> Iterator[str]:
    """Let chains fall, of one simulation after the other.

    Parameters
    ----------
    choose
        Finds the world that a URL's settings ask for.

    Yields
    ------
    str
        ``{"seed", "edges": [[seconds, channel, blocked], …], "truth": {…}}``.
    """
    for url, seeds, runs in asked:
        settings = read_settings(url)
        protocol = reader.read(settings.pop("protocol"))
        filmed = settings.pop("film", "0") == "1"
        hang, settings = choose(settings)
        dials = read_dials(settings)
        for seed, numbers in zip(seeds, runs, strict=True):
            truths: list[Truth] = []
            lab = hang(protocol, dials, seed, truths.append)
            lab.filmed = filmed
            labels = [pack_label(number, 1) for number in numbers]
            lab.make_ahead(labels)
            for label in labels:
                edges = lab.drop(label)
                yield json.dumps({"seed": seed, "edges": edges, "truth": asdict(truths.pop())})


def main(choose: Choose = choose_world) -> None:
    """Print the drops that the command line asks for."""
    words = iter(sys.argv[1:])
    triples = zip(words, words, words, strict=True)
    for line in falls((Request(u, json.loads(s), json.loads(r)) for u, s, r in triples), choose):
        print(line)


if __name__ == "__main__":
    main()
