"""A gate that chatters: the middles of long flickers are left out, and counted."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.chain_records import LONGEST, QUICK, EdgeArrays, thin
from rig.records import Drop, Edge
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case

HZ = 1_000_000
QUICK_TICKS = round(QUICK * HZ)
GAPS = st.lists(st.tuples(st.integers(0, 2), st.sampled_from([1, 50, 5000])), max_size=400)


def drop_of(gaps):
    """Edges of three channels, so many ticks apart."""
    ticks = np.cumsum([gap for _, gap in gaps]).tolist()
    edges = [
        Edge(t, channel, n % 2 == 0)
        for n, (t, (channel, _)) in enumerate(zip(ticks, gaps, strict=True))
    ]
    return Drop(1, 1, HZ, tuple(edges))


def flickers(drop, channel):
    """Numbers of a channel's edges by flicker, found edge by edge."""
    groups = []
    last = None
    for n, edge in enumerate(drop.edges):
        if edge.channel == channel:
            if last is None or edge.tick - last > QUICK_TICKS:
                groups.append([])
            groups[-1].append(n)
            last = edge.tick
    return groups


@given(GAPS)
def test_of_each_long_flicker_both_ends_are_left_and_every_edge_is_counted(gaps):
    drop = drop_of([*gaps, *[(1, 1)] * 100])
    edges = EdgeArrays.of(drop.edges, HZ)
    left = {}
    for channel in range(3):
        ends = [
            n
            for group in flickers(drop, channel)
            for n in (group if len(group) <= LONGEST
                      else group[: LONGEST // 2] + group[-LONGEST // 2 :])
        ]  # fmt: skip
        for group in flickers(drop, channel):
            long = (drop.edges[group[-1]].tick - drop.edges[group[0]].tick) / HZ
            left |= dict.fromkeys(group, long)
        assert edges.numbers[edges.of_channel(channel)].tolist() == ends
        total = sum(edge.channel == channel for edge in drop.edges)
        assert edges.count_thinned(channel) == total - len(ends)
    assert edges.burst == pytest.approx([left[n] for n in edges.numbers.tolist()])
    assert len(thin(drop, HZ).edges) == edges.numbers.size


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
