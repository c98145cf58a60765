"""Faults of the rig that are found and said: gates exchanged, chains of other rods."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import pytest

from rig.analysis.explanations import upside_down
from rig.protocol.protocol import Protocol
from tests.analysis.drops import GRADED, SCENES, UNIFORM, Case, case
from tests.analysis.sessions import MILD

CHANNELS = [gate.channel for gate in UNIFORM.gates.gates]
# Of all 120, some; (0, 2) and (4, 5) are one rod and three rods apart, within half a millimetre.
PAIRS = [*list(combinations(CHANNELS, 2))[::13], (0, 2), (4, 5), (10, 11)]


def exchanged(one: Case, a: int, b: int) -> Case:
    other = {a: b, b: a}
    return one.with_edges(
        [edge._replace(channel=other.get(edge.channel, edge.channel)) for edge in one.drop.edges]
    )


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_exchanged_gates_are_void_and_named(a, b):
    """Where few rods pass, or two are nearly alike, one gate may be all that is found strange."""
    one = case(UNIFORM, MILD, incline=40.0)
    result = exchanged(one, a, b).analyze()
    assert result.verdict == "void"
    text = "\n".join(result.reasons)
    named = [channel for channel in CHANNELS if f"channel {channel} " in text]
    assert set(named) <= {a, b}, text
    if (a, b) in {(0, 2), (4, 5), (10, 11)}:
        assert named == [a, b], text
        assert "wrong way round" in text


def with_rods(protocol: Protocol, rods: int) -> Protocol:
    """The same chains with rods added or taken off at the top."""
    chains = {}
    for name, one in protocol.chains.items():
        pitch = one.chain.heights[1]
        chain = replace(
            one.chain, masses=(1.0,) * rods, heights=tuple(pitch * k for k in range(rods))
        )
        chains[name] = replace(
            one, chain=chain, widths=one.widths[:1] * rods, diameters=one.diameters[:1] * rods
        )
    return replace(protocol, chains=chains)


@pytest.mark.parametrize("rods", [24, 26, 27])
@pytest.mark.parametrize("seed", [1, 2])
def test_another_number_of_rods_is_void_and_counted(rods, seed):
    one = case(with_rods(UNIFORM, rods), MILD, incline=40.0, seed=seed)
    result = replace(one, protocol=UNIFORM).analyze()
    assert result.verdict == "void"
    said = f"has {rods} rods, not 25 as the protocol says"
    each = [reason for reason in result.reasons if said in reason]
    assert len(each) == 2 or each[0].startswith("each chain ")


@pytest.mark.parametrize("role", ["impact", "free"])
def test_a_chain_upside_down_is_void_and_named(role):
    name = getattr(case(GRADED, MILD).run, role)
    turned = {**GRADED.chains, name: upside_down(GRADED.chains[name])}
    one = case(replace(GRADED, chains=turned), MILD)
    result = replace(one, protocol=GRADED).analyze()
    assert result.verdict == "void"
    assert result.reasons[-1].startswith(f"chain {name} hangs upside down on the {role} side (odds")
    assert len(result.reasons) == 2


def test_what_looks_the_same_both_ways_is_no_fault():
    assert upside_down(UNIFORM.chains["A"]) is None
    twice = upside_down(upside_down(GRADED.chains["A"]))
    assert twice.widths == GRADED.chains["A"].widths
    assert twice.chain.masses == GRADED.chains["A"].chain.masses


@pytest.mark.parametrize("scene", SCENES)
def test_a_good_rig_has_no_faults(scene):
    for seed in range(1, 6):
        result = case(SCENES[scene], MILD, seed=seed).analyze()
        assert (result.verdict, result.reasons) == ("accepted", ())
