"""Edges that are missing or belong to no rod, named against the simulation's hidden truth."""

import math
from collections import Counter
from operator import attrgetter

import pytest

from rig.analysis.chain_records import MISSED
from rig.analysis.edge_classes import SURPLUS
from rig.analysis.result import DropResult
from sim.dials import Dials
from tests.analysis.drops import STRAY, UNIFORM, Case, case, with_dials

LOWEST = {min(UNIFORM.gates.on(s), key=lambda gate: gate.height).channel for s in ("impact",)}
STRING_S = 250e-6  # the simulation's string flickers for up to 200 µs, its rods bounce for 2 ms


def kinds(result: DropResult) -> set[str]:
    return {edge.kind for edge in result.unmatched}


def consistent(result: DropResult) -> None:
    """One entry for each edge that the audit counts, each with its cost."""
    absent = [edge for edge in result.unmatched if edge.edge is None]
    surplus = [edge for edge in result.unmatched if edge.edge is not None]
    assert (len(absent), len(surplus)) == (result.audit.missed, result.audit.spurious)
    assert {edge.cost for edge in absent} <= {-math.log(MISSED)}
    assert all(edge.cost == (0.0 if edge.kind == "left out" else SURPLUS) for edge in surplus)
    assert not {edge.edge for edge in surplus} & result.matches.keys()
    assert [*result.unmatched] == sorted(result.unmatched, key=attrgetter("time_s"))


def shadow_s(one: Case, number: int) -> float:
    """How long the shadow lasted that an edge begins or ends, by the truth."""
    when, channel, blocked, _ = one.truth.edges[number]
    same = [edge[0] for edge in one.truth.edges if edge[1] == channel]
    at = same.index(when)
    return same[at + 1] - when if blocked else when - same[at - 1]


def test_each_edge_has_the_cause_that_it_has():
    """Everything at once, every dial at its default but twice as many faults of edges."""
    one = case(
        UNIFORM,
        Dials(skew_sd=1e-3, missed=0.02, chatter=0.01, string=0.004, bounce=0.1),
        incline=40.0,
        seed=1,
    )
    result = one.analyze()
    consistent(result)
    hidden = Counter()
    for edge in result.unmatched:
        if edge.edge is None or edge.kind == "left out":
            continue
        when, channel, blocked, rod = one.truth.edges[edge.edge]
        assert (edge.channel, edge.blocked) == (channel, blocked)
        assert edge.time_s == pytest.approx(when, abs=2e-6)
        if rod != STRAY:
            true = "chatter"
            assert edge.rod == rod
        elif shadow_s(one, edge.edge) < STRING_S:
            true = "string"
        else:
            true = "bounce"
            assert channel in LOWEST
        if true == "bounce" and edge.kind == "chatter":
            hidden["bounce at the very moment of a rod's edge"] += 1
            continue
        assert edge.kind == true
        assert (edge.rod is None) == (true != "chatter")
    assert hidden.total() <= 1
    assert {"chatter", "bounce"} <= kinds(result)


def test_a_rod_without_a_trace_and_a_gap_without_one():
    """Of a rod that never darkened a beam both edges are missing, of a gap one of each rod."""
    one = case(UNIFORM, with_dials(missed=0.04), incline=40.0)
    result = one.analyze()
    consistent(result)
    assert kinds(result) == {"missed", "merged"}
    there = {(channel, rod, blocked) for _, channel, blocked, rod in one.truth.edges}
    quiet = case(UNIFORM, Dials.quiet(), incline=40.0).truth.edges
    due = {(channel, rod, blocked): when for when, channel, blocked, rod in quiet}
    found = {(c.channel, c.rod, c.blocked): c for c in result.unmatched}
    assert found.keys() == due.keys() - there
    for (channel, rod, blocked), edge in found.items():
        alone = (channel, rod, not blocked) in there  # its other edge came
        if alone:
            assert edge.kind == "merged"
        assert edge.time_s == pytest.approx(due[channel, rod, blocked], abs=20e-6)
    # Two gaps in a row leave a rod between them without a trace, but in the dark.
    missed = [edge for edge in result.unmatched if edge.kind == "missed"]
    assert all((c.channel, c.rod, not c.blocked) in found for c in missed)
