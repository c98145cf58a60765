"""Matching edges to rods: optimal by brute force, and right on edges whose rods are known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.align import EXTRA, MISSED, Pairing
from rig.analysis.chain_records import ChainRecord, EdgeTrain
from rig.analysis.trajectory import free_trajectory
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case
from tests.examples import examples


def align(trains, levels, trajectory, scale, clock=0.0):
    """Match all trains of a side at once."""
    every = np.concatenate([*levels, np.zeros(0)])
    return Pairing.of(trains).matched(every, trajectory, scale, clock)


GRAVITY = 9.81
START = 0.5
PATH = free_trajectory(0.0, START, GRAVITY)
SCALE = 1e-3

# An edge: where the chain is when it comes, in units of SCALE, and its polarity.
edges = st.lists(st.tuples(st.floats(-12, 12), st.booleans()), max_size=4)
gates = st.lists(
    st.tuples(edges, st.lists(st.tuples(st.floats(-12, 12), st.booleans()), max_size=5)), max_size=3
)


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


def cost(match, observed, expected) -> float:
    """What a matching costs; it must be one to one, in order, and of like polarity."""
    taken = [(int(n), k) for k, n in enumerate(match) if n >= 0]
    assert [n for n, _ in taken] == sorted({n for n, _ in taken})
    assert all(observed[n][1] == expected[k][1] for n, k in taken)
    pairs = sum(0.5 * (observed[n][0] - expected[k][0]) ** 2 for n, k in taken)
    left = len(observed) - len(taken), len(expected) - len(taken)
    return pairs + EXTRA * left[0] + MISSED * left[1]


def cheapest(observed, expected) -> float:
    """Try everything."""

    @cache
    def rest(n: int, k: int) -> float:
        if n == len(observed):
            return MISSED * (len(expected) - k)
        if k == len(expected):
            return EXTRA * (len(observed) - n)
        ways = [EXTRA + rest(n + 1, k), MISSED + rest(n, k + 1)]
        if observed[n][1] == expected[k][1]:
            ways.append(0.5 * (observed[n][0] - expected[k][0]) ** 2 + rest(n + 1, k + 1))
        return min(ways)

    return rest(0, 0)


@examples(300)
@given(gates)
def test_no_matching_is_cheaper(drawn):
    built = [build(number, *one) for number, one in enumerate(drawn)]
    trains = [train for train, _, _ in built]
    found = align(trains, [train.levels for train in trains], PATH, SCALE)
    assert len(found) == len(built)
    for match, (_, observed, expected) in zip(found, built, strict=True):
        assert match.shape == (len(expected),)
        # Equal within 1e-9 a step counts as equal, and heights come out of times rounded.
        assert cost(match, observed, expected) == pytest.approx(
            cheapest(tuple(observed), tuple(expected)), abs=3e-8
        )


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
