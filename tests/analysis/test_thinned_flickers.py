"""A gate that chatters: the middles of long flickers are left out, and counted."""

import time

import numpy as np

from rig.records import Edge
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case


def test_a_gate_that_chatters_all_the_time_is_named_and_others_are_read():
    count = 100_000
    one = case(UNIFORM, Dials.quiet(), incline=40.0)
    clean = one.analyze()
    channel = UNIFORM.gates.on("impact")[3].channel
    low, high = one.drop.edges[0].tick, one.drop.edges[-1].tick
    ticks = np.linspace(low, high, count).astype(int).tolist()
    others = [edge for edge in one.drop.edges if edge.channel != channel]
    noisy = one.with_edges([*others, *(Edge(t, channel, n % 2 == 1) for n, t in enumerate(ticks))])
    begun = time.process_time()
    result = noisy.analyze()
    assert time.process_time() - begun < 20.0
    audit = result.audit
    assert audit.received == len(noisy.drop.edges)
    assert audit.matched + audit.spurious == audit.received
    surplus = [edge for edge in result.unmatched if edge.edge is not None]
    assert len(surplus) + audit.thinned == audit.spurious
    assert audit.json().get("thinned", 0) == audit.thinned
    assert audit.thinned > 0
    for number, rod in result.matches.items():
        if noisy.drop.edges[number].channel != channel:
            at = one.drop.edges.index(noisy.drop.edges[number])
            assert clean.matches.get(at, rod) == rod
    assert result.verdict == "void"
    assert any(f"channel {channel}" in reason.text for reason in result.reasons)
