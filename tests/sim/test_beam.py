"""One beam: shadows merged, and what a real receiver makes of them."""

import math
from bisect import bisect_right
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.beam import NOT_A_ROD, Shadow, receive, union
from tests.sim.chance import SIGMAS, assert_binomial, with_dials

N = 8000
PERIOD, WIDTH = 10e-3, 4e-3


def rods(n: int = N) -> list[Shadow]:
    """Shadows far from each other."""
    return [Shadow(0.01 + i * PERIOD, 0.01 + i * PERIOD + WIDTH, i) for i in range(n)]


def seen(seed: int = 1, n: int = N, **dials: float):
    return receive(rods(n), 5, with_dials(**dials), np.random.default_rng(seed))


shadows = st.lists(
    st.tuples(st.integers(0, 60), st.integers(0, 8), st.integers(-1, 9)).map(
        lambda s: Shadow(s[0], s[0] + s[1], s[2])
    ),
    max_size=20,
)


@given(shadows)
def test_union_covers_the_same_instants(given_shadows):
    def dark(things):
        # Half steps too, so that touching intervals are one and neighbours are two.
        return {t for s in things for t in range(2 * int(s.start), 2 * int(s.end) + 1)}

    merged = [shadow for shadow, _ in union(given_shadows)]
    assert dark(merged) == dark(given_shadows)
    assert all(a.end < b.start for a, b in pairwise(merged))


@pytest.mark.parametrize("missed", [0.01, 0.1, 0.5])
def test_the_share_of_missed_edges_is_the_dial(missed):
    lost_pairs, odd = divmod(2 * N - len(seen(missed=missed)), 2)
    assert odd == 0
    assert_binomial(lost_pairs, N, missed)


@pytest.mark.parametrize("chatter", [0.005, 0.2])
def test_chatter_comes_in_bursts_at_the_dial_s_share(chatter):
    n = 5000
    edges = seen(n=n, chatter=chatter)
    true_edges = [t for s in rods(n) for t in (s.start, s.end)]
    bursts: list[list] = [[] for _ in true_edges]
    for edge in edges:
        bursts[bisect_right(true_edges, edge.time_s) - 1].append(edge)  # each begins on time
    for i, burst in enumerate(bursts):
        assert burst[0].time_s == true_edges[i]
        assert burst[-1].time_s - burst[0].time_s <= 6 * 120e-6
        assert burst[-1].blocked == burst[0].blocked == (i % 2 == 0)
    sizes = Counter(map(len, bursts))
    assert set(sizes) <= {1, 3, 5, 7}
    flickers = 2 * n - sizes[1]
    assert_binomial(flickers, 2 * n, chatter)
    for size in (3, 5, 7):
        assert_binomial(sizes[size], flickers, 1 / 3)


def test_jitter_scatters_by_its_standard_deviation_without_bias():
    sd = 50e-6  # far below the distance of two edges, so that order does not clip it
    errors = np.array([e.time_s for e in seen(jitter_sd=sd)]) - np.array(
        [t for s in rods() for t in (s.start, s.end)]
    )
    assert abs(errors.mean()) < SIGMAS * sd / math.sqrt(2 * N)
    assert abs(errors.std() / sd - 1) < SIGMAS / math.sqrt(4 * N)


def test_a_bounce_behind_a_rod_prolongs_its_shadow():
    merged = union([Shadow(1.5, 3.0, NOT_A_ROD), Shadow(1.0, 2.0, 7), Shadow(4.0, 5.0, 8)])
    assert merged == [(Shadow(1.0, 3.0, 7), NOT_A_ROD), (Shadow(4.0, 5.0, 8), 8)]


@given(
    st.lists(st.tuples(st.floats(0, 0.5), st.floats(0, 0.05), st.integers(-1, 30)), max_size=40),
    st.integers(0, 2**32),
    st.builds(
        with_dials,
        missed=st.floats(0, 1),
        chatter=st.floats(0, 1),
        jitter_sd=st.sampled_from([0.0, 2e-6, 1e-3, 0.1]),
    ),
)
def test_levels_alternate_and_time_runs_forward(things, seed, dials):
    given_shadows = [Shadow(start, start + width, rod) for start, width, rod in things]
    edges = receive(given_shadows, 3, dials, np.random.default_rng(seed))
    assert [e.blocked for e in edges] == [i % 2 == 0 for i in range(len(edges))]
    assert len(edges) % 2 == 0  # it is clear again in the end
    assert all(a.time_s <= b.time_s for a, b in pairwise(edges))
    assert all(e.channel == 3 for e in edges)
