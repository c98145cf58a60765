"""Trial drops: how many of a layout's drops would be read, by the same code that reads real ones.

Everything that a protocol states an uncertainty of is off by chance, edges are missed, and chains
are let go one after the other. A drop is read if it is not void for what its edges look like and
every edge that is given to a rod is that rod's.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from itertools import cycle, islice
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.annealing import EVER, MISSED
from rig.analysis.components import above, stated
from rig.analysis.identify import Identification, deciding_gate, identify
from rig.analysis.verdict import pattern_faults
from rig.design.cases import CLOCK_U, RELEASE_S, model_alphas, records_of, trajectory, with_edges
from rig.protocol.contact import at_contact
from rig.protocol.plan import runs
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.arrays import Index
    from rig.protocol.protocol import Protocol, Run
    from rig.vocabulary import Vocabulary


DROPS = 20
"""Trials of a layout: one drop in twenty that fails shows in two lists of three."""
_WINDOW = (0.0, np.inf)
_SEED = 1  # the same drops for every layout, and on every machine


@dataclass(frozen=True, slots=True)
class Trials:
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
    kinds = {(run.incline_deg, run.impact, run.free): run for run in reversed(runs(protocol))}
    read, failing = 0, Counter[str]()
    further_gate: tuple[str, float] | None = None
    for run in islice(cycle(kinds.values()), drops):
        protocol_here = at_contact(protocol, run.incline_deg, run.impact)
        start = protocol_here.drop.value + protocol_here.drop.u * rng.standard_normal()
        fallen = [
            _fallen(protocol_here, record, run, start, rng)
            for record in records_of(protocol_here, run)
        ]
        identification, wrong = read_drop(protocol_here, fallen, _WINDOW)
        read += not wrong
        failing.update(wrong)
        if (
            wrong
            and further_gate is None
            and identification.fit is not None
            and identification.other is not None
        ):
            further_gate = deciding_gate(identification.fit, identification.other)
    return Trials(drops, read, tuple(failing.items()), further_gate)


def _fallen(
    protocol: Protocol, record: ChainRecord, run: Run, start: float, rng: np.random.Generator
) -> tuple[ChainRecord, list[Index]]:
    """Let one chain fall that hangs and is let go a little off, with impulses that scatter.

    With it, for each train, which edge each expected edge is.
    """
    assert protocol.gates is not None
    chain = record.chain
    rods = chain.position_u * rng.standard_normal(chain.chain.rods)
    wider = chain.width_u * rng.standard_normal()
    start += protocol.priors.hang * rng.standard_normal()
    release = RELEASE_S + 0.5 * protocol.accept.release_skew * rng.uniform(-1.0, 1.0)
    alphas = model_alphas(protocol, record, run)
    if alphas.size:
        scatter = stated(protocol).impulses(alphas.mean(), above(chain.chain))
        alphas += scatter * rng.standard_normal(alphas.size)
    path = trajectory(protocol, record, release, start, alphas, rods)
    datum = protocol.gates.datum_u * rng.standard_normal()
    trains, truth = [], []
    for train in record.trains:
        beam = datum + protocol.gates.height_u * rng.standard_normal()
        levels = train.levels + beam - rods[train.rods]
        levels -= np.where(train.blocks, -0.5, 0.5) * wider
        seen = np.flatnonzero((levels < path.height[0]) & (rng.random(levels.size) >= MISSED))
        times = path.times(levels[seen]) + protocol.priors.jitter * rng.standard_normal(seen.size)
        order = np.argsort(times, kind="stable")
        edges = np.full(levels.size, -1)
        edges[seen[order]] = np.arange(seen.size)
        trains.append(with_edges(train, times[order], train.blocks[seen[order]]))
        truth.append(edges)
    return replace(record, trains=tuple(trains)), truth


def read_drop(
    protocol: Protocol,
    fallen: Sequence[tuple[ChainRecord, Sequence[Index]]],
    window: tuple[float, float] = EVER,
) -> tuple[Identification, list[str]]:
    """Read a drop; with it return the sides of which no fall, or the wrong one, was found.

    Parameters
    ----------
    protocol
        With heights counted from the contact point.
    fallen
        Each chain, and for each of its trains which edge every expected edge is, −1 if missed.
    """
    records = [record for record, _ in fallen]
    identification = identify(protocol, records, CLOCK_U, stated(protocol), window)
    unlike = list(pattern_faults(identification))
    if unlike or identification.fit is None:
        return identification, unlike or [record.role for record in records]
    matches = identification.fit.matches
    return identification, [
        record.role
        for record, truth in fallen
        if any(
            np.any((match >= 0) & (match != true))
            for match, true in zip(matches[record.role], truth, strict=True)
        )
    ]


def trials_text(outcome: Trials, words: Vocabulary) -> str:
    """Say how many simulated trial drops were identified, and which gate would help."""
    share = "all" if outcome.read == outcome.drops else f"{outcome.read} of"
    text = f"{share} {outcome.drops} simulated trial drops were identified"
    if outcome.failing and words.two_sides:
        sides = " and ".join(f"{side} side ({count})" for side, count in outcome.failing)
        text += f"; unclear: {sides}"
    if outcome.wanted is not None:
        side, height = outcome.wanted
        gate = f"{side} gate" if words.two_sides else "gate"
        text += f"; add a {gate} at {height * 1e3:.0f} mm"
    elif outcome.failing:
        text += "; add a gate well above the lowest gate"
    return text
