"""Trial drops: how many of a layout's drops would be read, by the same code that reads real ones.

Everything that a protocol states an uncertainty of is off by chance, edges are missed, and chains
are let go one after the other. A drop is read if it is not void for what its edges look like and
every edge that is given to a rod is that rod's.
"""

import math
from collections import Counter
from collections.abc import Sequence
from itertools import cycle, islice
from typing import NamedTuple

import numpy as np

from rig.analysis.chain_records import ChainRecord
from rig.analysis.components import priors
from rig.analysis.identify import LEAD, Identification, deciding_gate, identify, pattern_faults
from rig.arrays import Index
from rig.design.cases import CLOCK_U, perfect, predict_drop, with_edges
from rig.protocol.contact import of_run
from rig.protocol.protocol import Protocol, Run
from rig.threads import one_thread

DROPS = 20
"""Trials of a layout: one drop in twenty that fails shows in two lists of three."""
MARGIN = 2.0 * LEAD
"""Log odds that perfect edges must have: real ones are missed, and flicker."""
_OFF = 2.0  # standard uncertainties that the drop may be off
_SEED = 1  # the same drops for every layout, and on every machine


class Trials(NamedTuple):
    """What became of a layout's trial drops.

    Attributes
    ----------
    drops, read
        How many there were, and how many were read rightly.
    failing
        Side whose edges told too little, and in how many drops.
    wanted
        Side and height of a further gate that would tell apart what looked alike, m.
    """

    drops: int
    read: int
    failing: tuple[tuple[str, int], ...] = ()
    wanted: tuple[str, float] | None = None


@one_thread
def trials(protocol: Protocol, drops: int = DROPS) -> Trials:
    """Let chains fall before a protocol's gates, and read their edges.

    Parameters
    ----------
    drops
        How many, in turn at all inclines and with either chain where they are unlike.
    """
    rng = np.random.default_rng(_SEED)
    kinds = {run.kind: run for run in reversed(protocol.runs())}
    read, failing = 0, Counter[str]()
    further_gate: tuple[str, float] | None = None
    for run in islice(cycle(kinds.values()), drops):
        protocol_here = of_run(protocol, run)
        fallen = _fall(protocol_here, run, rng)
        identification, wrong = read_drop(protocol_here, fallen, 0.0)
        read += not wrong
        failing.update(wrong)
        if wrong and not further_gate and identification.drop and identification.other:
            further_gate = deciding_gate(identification.drop, identification.other)
    return Trials(drops, read, tuple(failing.items()), further_gate)


def _fall(protocol: Protocol, run: Run, rng: np.random.Generator) -> list[ChainRecord]:
    """Let chains fall that hang and are let go a little off, with impulses that scatter."""
    model, x = predict_drop(protocol, run, priors(protocol))
    at, sd, fallen = model.unknowns, model.unknowns.sd, []

    def shake(name: str, members: int | slice | Index = slice(None)) -> None:
        places = np.atleast_1d(np.arange(x.size)[at[name]][members])
        x[places] += sd[places] * rng.standard_normal(places.size)

    shake("drop")
    for role, record in model.records.items():
        for name in ("rods", "width", "hang"):
            shake(f"{role} {name}")
        x[at[f"{role} release"]] += 0.5 * protocol.accept.release_skew * rng.uniform(-1.0, 1.0)
        if record.ratios is not None:
            shake("impulses")
        shake("datum", protocol.gates.posts.index(record.role))
        path, gates = model.trajectory(role, x), record.due.gate
        shake("beams", np.unique(gates))
        levels = model.all_levels(role, x)
        comes = rng.random(levels.size) >= record.due.absent
        seen = np.flatnonzero(comes & (levels < path.height[0]))
        jitter = protocol.priors.jitter * rng.standard_normal(seen.size)
        times = path.times(levels[seen]) + jitter
        order = np.lexsort((times, gates[seen]))
        fallen.append(with_edges(record, seen[order], times[order]))
    return fallen


def read_drop(
    protocol: Protocol, records: Sequence[ChainRecord], earliest: float = -math.inf
) -> tuple[Identification, list[str]]:
    """Read a drop; with it return the sides of which no fall, or the wrong one, was found.

    Parameters
    ----------
    protocol
        With heights counted from the contact point.
    records
        Each chain, with edges numbered as `rig.design.cases.with_edges` has them.
    earliest
        When chains were let go at the earliest, s.
    """
    identification = identify(protocol, records, CLOCK_U, earliest)
    unlike = list(pattern_faults(identification))
    if unlike or identification.drop is None:
        return identification, unlike or [record.role for record in records]
    matches = identification.drop.matches
    return identification, [
        record.role
        for record in records
        for match in [matches[record.role]]
        if np.any(record.edges.number[match[match >= 0]] != np.flatnonzero(match >= 0))
    ]


def margin(protocol: Protocol) -> float:
    """Log odds by which the right fall leads the next best one; −∞ where it is not found at all.

    The least over the outermost inclines, with chains hung higher or lower than stated and every
    edge seen where it should be; no more than `MARGIN`.
    """
    least, inclines = MARGIN, protocol.plan.inclines
    ends = [run for run in protocol.runs() if run.incline_deg in {min(inclines), max(inclines)}]
    for run in {(run.incline_deg, run.setting): run for run in reversed(ends)}.values():
        here = of_run(protocol, run)
        model, x = predict_drop(here, run, priors(here))
        for off in (-_OFF, _OFF):
            x[model.unknowns["drop"]] = off * protocol.drop.u
            identification, unclear = read_drop(here, perfect(model, x))
            if identification.drop is None or unclear:
                return -math.inf
            least = min(least, identification.log_odds)
    return least


def readable(protocol: Protocol) -> bool:
    """Whether every edge of a layout finds its rod, with something in hand."""
    return margin(protocol) >= MARGIN
