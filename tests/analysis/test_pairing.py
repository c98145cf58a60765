"""Matching edges to rods: by weights of all rods, and right on edges whose rods are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.annealing import MISSED, STRAYS, Pairing
from rig.analysis.chain_records import ChainRecord, EdgeTrain
from rig.analysis.trajectory import free_trajectory
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case
from tests.examples import examples


def align(trains, levels, trajectory, scale, clock=0.0, widths=()):
    """Match all trains of a side at once."""
    every = np.concatenate([*levels, np.zeros(0)])
    pairing = Pairing.of(trains, widths)
    heights, speeds = trajectory.heights(pairing.times * (1.0 + clock))
    return pairing.matched(every, heights, speeds, scale)


GRAVITY = 9.81
START = 0.5
PATH = free_trajectory(0.0, START, GRAVITY)
SCALE = 1e-3

# An edge: where the chain is when it comes, in units of SCALE, and its polarity.
edges = st.lists(st.tuples(st.floats(-12, 12), st.booleans()), max_size=4)
# Rods of one polarity are further apart than an edge may be off.
places = st.integers(-3, 3).map(lambda n: 4.0 * n)
rods = st.lists(st.tuples(places, st.booleans()), max_size=5, unique=True)
gates = st.lists(st.tuples(edges, rods), max_size=3)


def at(height: float) -> float:
    return float(np.sqrt(2 * (START - height) / GRAVITY))


def build(number: int, observed, expected) -> tuple[EdgeTrain, list, list]:
    observed = sorted(observed, key=lambda edge: -edge[0])
    expected = sorted(expected, key=lambda edge: -edge[0])
    train = EdgeTrain(
        number,
        np.array([at(SCALE * height) for height, _ in observed]),
        np.array([blocked for _, blocked in observed], dtype=np.bool_),
        np.zeros(len(observed)),
        np.arange(len(observed)),
        np.arange(len(expected)),
        np.array([blocks for _, blocks in expected], dtype=np.bool_),
        np.array([SCALE * height for height, _ in expected]),
    )
    return train, observed, expected


def weight(off: float, others: list[float], speed: float) -> float:
    """How probably an edge is the side that it misses by `off`, of all it might be; in SCALE."""
    density = [
        (1.0 - MISSED) * math.exp(-0.5 * far**2) / (SCALE * math.sqrt(2.0 * math.pi))
        for far in (off, *others)
    ]
    return density[0] / (STRAYS / speed + sum(density))


@examples(300)
@given(gates)
def test_each_edge_is_the_rod_that_it_probably_is(drawn):
    """One to one, of like polarity; none is taken that is improbable, none left that is not."""
    built = [build(number, *one) for number, one in enumerate(drawn)]
    trains = [train for train, _, _ in built]
    found = align(trains, [train.levels for train in trains], PATH, SCALE)
    assert len(found) == len(built)
    for match, (_, observed, expected) in zip(found, built, strict=True):
        assert match.shape == (len(expected),)
        taken = match[match >= 0].tolist()
        assert len(taken) == len({*taken})
        wanted: dict[int, int] = {}
        for n, (height, blocked) in enumerate(observed):
            speed = math.sqrt(2.0 * GRAVITY * (START - SCALE * height))
            offs = [
                (abs(height - level), k)
                for k, (level, blocks) in enumerate(expected)
                if blocks == blocked
            ]
            for k in np.flatnonzero(match == n).tolist():
                assert expected[k][1] == blocked
                others = [off for off, other in offs if other != k]
                mine = abs(height - expected[k][0])
                assert weight(mine, others, speed) > 0.499
            if offs:
                (nearest, k), *rest = sorted(offs)
                if weight(nearest, [off for off, _ in rest], speed) > 0.501:
                    wanted[n] = k
        # Whoever is wanted gets an edge.
        assert {*wanted.values()} <= {*np.flatnonzero(match >= 0).tolist()}


def test_a_gate_alone_is_matched_as_among_others():
    rng = np.random.default_rng(4)
    drawn = [
        (
            [
                (float(x), bool(b))
                for x, b in zip(rng.uniform(-9, 9, n), rng.integers(0, 2, n), strict=True)
            ],
            [
                (float(x), bool(b))
                for x, b in zip(rng.uniform(-9, 9, m), rng.integers(0, 2, m), strict=True)
            ],
        )
        for n, m in ((9, 3), (0, 6), (5, 0), (7, 7))
    ]
    trains = [build(number, *one)[0] for number, one in enumerate(drawn)]
    together = align(trains, [train.levels for train in trains], PATH, SCALE)
    for train, match in zip(trains, together, strict=True):
        (alone,) = align([train], [train.levels], PATH, SCALE)
        np.testing.assert_array_equal(match, alone)


def test_a_slow_clock_is_allowed_for():
    rng = np.random.default_rng(6)
    drawn = [
        (float(x), bool(b))
        for x, b in zip(rng.uniform(-9, 9, 9), rng.integers(0, 2, 9), strict=True)
    ]
    train, *_ = build(0, drawn, drawn[::2])
    (match,) = align([train], [train.levels], PATH, SCALE)
    slow = replace(train, times=train.times / 1.004)
    (found,) = align([slow], [train.levels], PATH, SCALE, 0.004)
    np.testing.assert_array_equal(found, match)
    assert (align([slow], [train.levels], PATH, SCALE)[0] != match).any()


def test_no_gate_nothing_to_match():
    assert align([], [], PATH, SCALE) == []


QUIET = case(UNIFORM, Dials.quiet(), incline=40.0)
FALL = free_trajectory(0.020, 0.180, GRAVITY)  # the free side, exactly


def matched(side: ChainRecord) -> list:
    return align(side.trains, [train.levels for train in side.trains], FALL, 0.5e-3)


def kept(train: EdgeTrain, keep) -> EdgeTrain:
    """A gate that reported only some of its edges."""
    return replace(
        train,
        times=train.times[keep],
        blocked=train.blocked[keep],
        burst=train.burst[keep],
        edge=train.edge[keep],
    )


def with_extra(train: EdgeTrain, when, blocked) -> EdgeTrain:
    """A gate that reported more edges; theirs are numbered −1."""
    order = np.argsort(np.concatenate([train.times, when]), kind="stable")
    return replace(
        train,
        times=np.concatenate([train.times, when])[order],
        blocked=np.concatenate([train.blocked, blocked])[order],
        burst=np.zeros(order.size),
        edge=np.concatenate([train.edge, np.full(len(when), -1)])[order],
    )


def test_a_perfect_record_is_matched_edge_by_edge():
    for train, match in zip(QUIET.side("free").trains, matched(QUIET.side("free")), strict=True):
        np.testing.assert_array_equal(match, np.arange(train.rods.size))
        truth = [QUIET.truth.edges[edge][3] for edge in train.edge]
        np.testing.assert_array_equal(train.rods, truth)


@pytest.mark.parametrize("rods", [[0], [7], [24], [3, 4], [11, 12, 13]])
def test_rods_that_were_missed_are_missed(rods):
    side = QUIET.side("free")
    there = [~np.isin(train.rods, rods) for train in side.trains]
    trains = tuple(kept(train, keep) for train, keep in zip(side.trains, there, strict=True))
    found = matched(replace(side, trains=trains))
    for whole, train, keep, match in zip(side.trains, trains, there, found, strict=True):
        np.testing.assert_array_equal(match >= 0, keep)
        np.testing.assert_array_equal(train.edge[match[keep]], whole.edge[keep])


def test_a_flash_in_the_gap_is_extra():
    side = QUIET.side("free")
    gaps = [
        train.times[5] + np.diff(train.times)[5] * np.array([0.4, 0.5]) for train in side.trains
    ]
    trains = tuple(
        with_extra(train, gap, [True, False]) for train, gap in zip(side.trains, gaps, strict=True)
    )
    found = matched(replace(side, trains=trains))
    for whole, train, match in zip(side.trains, trains, found, strict=True):
        # An extra edge is numbered −1; none of them was taken.
        np.testing.assert_array_equal(train.edge[match], whole.edge)


def test_chatter_costs_no_rod_its_edges():
    side = QUIET.side("free")
    chattering = replace(
        side,
        trains=tuple(
            with_extra(
                train,
                np.concatenate([[t + 40e-6, t + 90e-6] for t in train.times[::4]]),
                np.concatenate([[not b, b] for b in train.blocked[::4]]),
            )
            for train in side.trains
        ),
    )
    for train, whole, match in zip(
        chattering.trains, side.trains, matched(chattering), strict=True
    ):
        assert (match >= 0).all()
        # Whichever edge of a burst stands for the rod, it is of that burst.
        assert np.abs(train.times[match] - whole.times).max() <= 90e-6 + 1e-12
        np.testing.assert_array_equal(train.blocked[match], train.blocks)


def test_no_end_of_another_shadow_is_taken_for_the_top_rods():
    """A rod thrown back and the top rod make one shadow, and it ends about when the top rod would.

    Of a rod amid the chain its neighbours tell.
    """
    side = QUIET.side("free")
    widths = side.chain.widths
    for rod in (12, 24):
        (train, *_) = side.trains
        begin = int(np.flatnonzero((train.rods == rod) & train.blocks)[0])
        times = train.times.copy()
        times[begin] -= 2.5 * (times[begin + 1] - times[begin])  # so much earlier it darkens
        (match,) = align([replace(train, times=times)], [train.levels], FALL, 0.5e-3, widths=widths)
        assert match[begin] == -1
        assert (match[begin + 1] == -1) == (rod == 24)
        assert (np.delete(match, [begin, begin + 1]) >= 0).all()
