"""The edges' votes, and what becomes of them, find the fall in real records and none elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis import pattern
from rig.analysis.identify import adjusted
from rig.analysis.pattern import EVER, guesses, slack_of
from rig.analysis.verdict import LEAD, SUPPORT
from rig.model.impact import impact_on
from rig.records import Edge
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import FENCE, HZ, SCENES, UNIFORM, Case, case, codes
from tests.examples import examples

DELAY = 0.020
KNOWN = Dials(delay=DELAY, delay_sd=0.0)  # so that the truth knows the release times
RECORD = case(UNIFORM, Dials.quiet(), incline=40.0)


def assert_found(one: Case) -> None:
    """Release and α good enough to tell rods apart, with support that no pile of edges has."""
    found = one.identify()
    assert found.fit is not None
    assert found.log_odds > LEAD
    assert min(found.shares.values()) > 0.9
    chain = next(iter(one.protocol.chains.values())).chain
    pitch = float(np.diff(chain.heights).min())
    skew = one.truth.release_skew_s or 0.0
    for role in found.fit.model.records:
        begin = adjusted(found.fit, role)
        late = begin.release - DELAY - (skew if role == "free" else 0.0)
        # The fastest chain is at 8 m/s; a twelfth of the pitch leaves no doubt which rod it is.
        assert abs(late) * 8.0 < pitch / 12
        assert abs(begin.start - one.protocol.drop.value) < pitch / 12
        if role == "impact":
            impact = impact_on(one.protocol.surface, chain, one.run.incline_deg)
            # What few beams leave open, and the mean of the impulses' own scatter of 2 %.
            assert abs(begin.alpha - impact.alpha) < 0.01 + 0.02 * impact.alpha
        else:
            assert begin.alpha == 0.0


@pytest.mark.parametrize("incline", [0.0, 30.0, 40.0, 60.0, 80.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_every_incline_is_found(incline, seed):
    assert_found(case(UNIFORM, KNOWN, incline=incline, seed=seed))


@pytest.mark.parametrize("scene", ["graded", "single", "fence"])
@pytest.mark.parametrize("seed", [1, 2])
def test_every_scene_is_found(scene, seed):
    assert_found(case(SCENES[scene], KNOWN, seed=seed))


@pytest.mark.parametrize("skew", [-12e-3, -4e-3, 4e-3, 12e-3])
def test_each_side_is_found_however_late(skew):
    # The skew is a normal number times the dial: the seed's own number, asked for first.
    unit = case(UNIFORM, replace(Dials.quiet(), skew_sd=1.0), incline=40.0).truth.release_skew_s
    assert_found(case(UNIFORM, replace(KNOWN, skew_sd=skew / unit), incline=40.0))


@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.8])
def test_alpha_is_found_far_from_what_the_model_expects(restitution):
    one = case(UNIFORM, replace(Dials.quiet(), restitution=restitution), incline=40.0)
    chain = UNIFORM.chains["A"].chain
    true = impact_on(UNIFORM.surface, chain, 40.0, restitution=restitution).alpha
    assert one.guesses()["impact"].alpha == pytest.approx(true, abs=2e-3)


@pytest.mark.parametrize("scene", SCENES)
def test_one_of_the_first_votes_is_the_fall(scene):
    """All rods at all beams vote for where the chain really began, to a part of their distance."""
    one = case(SCENES[scene], replace(Dials.quiet(), delay=DELAY))
    for record in one.records:
        alpha = 0.0
        if record.ratios is not None:
            chain = record.chain.chain
            alpha = impact_on(one.protocol.surface, chain, one.run.incline_deg).alpha
        found = [*guesses(record, one.protocol.drop, one.protocol.gravity.value)]
        assert found[0].votes == record.expected
        assert abs(found[0].release - DELAY) * 8.0 < 3.0 * slack_of(record)
        assert abs(found[0].alpha - alpha) < 0.05


def test_votes_are_only_counted_where_a_release_may_be():
    drop, gravity = RECORD.protocol.drop, RECORD.protocol.gravity.value
    for record in RECORD.records:
        best = next(guesses(record, drop, gravity))
        assert next(guesses(record, drop, gravity, window=EVER)) == best
        for begin, end in ((-0.01, 0.01), (0.02, 0.2)):
            window = best.release + begin, best.release + end
            found = [*guesses(record, drop, gravity, window=window)]
            # Half the widest vote is a window's edge.
            assert all(window[0] - 0.01 < one.release < window[1] + 0.01 for one in found)
            near = max(one.votes for one in found)
            assert (near > 0.95 * best.votes) == (begin < 0.0)
        assert not [*guesses(record, drop, gravity, window=(-np.inf, -60.0))]


def test_no_chain_begins_below_what_it_strikes():
    """A drop stated so badly that some starts within its uncertainty are no starts."""
    (record, *_) = RECORD.records
    found = [*guesses(record, Quantity(0.01, 0.01), RECORD.protocol.gravity.value)]
    assert all(one.start > 0.0 for one in found)


@pytest.mark.parametrize("late", [1.0, 1800.0])
def test_a_record_may_begin_long_before_the_fall_and_end_long_after_it(late):
    """Also of half an hour, with edges at either end of it."""
    ends = [Edge(0, 0, True), Edge(round(2 * late * HZ), 0, False)]
    moved = [edge._replace(tick=edge.tick + round(late * HZ)) for edge in RECORD.drop.edges]
    result = RECORD.with_edges([*ends, *moved]).analyze()
    assert result.audit.missed == 0
    assert result.audit.matched == len(moved)


def pile(scene: Case, count: int, seed: int) -> Case:
    """As many edges anywhere, each gate's polarities alternating as on a wire."""
    rng = np.random.default_rng(seed)
    channels = [gate.channel for gate in scene.protocol.gates.gates]
    level = dict.fromkeys(channels, False)
    edges = []
    for tick in np.sort(rng.integers(0, int(0.8 * HZ), count)).tolist():
        channel = int(rng.choice(channels))
        level[channel] = not level[channel]
        edges.append(Edge(tick, channel, level[channel]))
    return scene.with_edges(edges)


@pytest.mark.parametrize("piled", [False, True])
def test_falls_that_cannot_have_votes_enough_are_not_counted(monkeypatch, piled):
    scene = pile(RECORD, len(RECORD.drop.edges), 2) if piled else RECORD
    counted = []

    def count(moments, expected, late, *bounds):
        counted.append(moments.size * late.shape[1])
        return votes(moments, expected, late, *bounds)

    votes = pattern._votes
    monkeypatch.setattr(pattern, "_votes", count)
    drop, gravity = scene.protocol.drop, scene.protocol.gravity.value
    for record in scene.records:
        least = 0.6 * record.expected
        every = [*guesses(record, drop, gravity)]
        whole, counted = sum(counted), []
        some = [*guesses(record, drop, gravity, least=least)]
        assert [one for one in some if one.votes >= least] == [
            one for one in every if one.votes >= least
        ]
        if piled and record.ratios is not None:
            assert sum(counted) < whole / 2
        counted = []


@pytest.mark.parametrize(("share", "seed"), [(0.5, 0), (1.0, 1)])
def test_a_pile_of_edges_looks_like_no_chain(share, seed):
    one = pile(RECORD, round(share * len(RECORD.drop.edges)), seed)
    assert max(one.identify().shares.values()) < SUPPORT - 0.2
    result = one.analyze()
    assert result.verdict == "void"
    assert set(codes(result)) & {"few_edges_fit", "no_fall"}


@examples(10)
@given(
    st.sampled_from([RECORD, case(FENCE, Dials.quiet())]),
    st.lists(st.tuples(st.integers(-HZ, 3 * HZ), st.integers(0, 15), st.booleans()), max_size=25),
)
def test_any_few_edges_give_a_verdict(scene, edges):
    result = scene.with_edges([Edge(*edge) for edge in edges]).analyze()
    # So few cannot be the 32 of the fence less the 15 % that may be missed.
    assert result.verdict == "void"
    assert result.reasons
    assert result.audit.received <= len(edges)


def test_of_a_record_that_lasts_minutes_the_fullest_seconds_are_searched():
    times, expected = np.array([0.0, 100.0, 101.0, 102.0, 200.0]), np.arange(5)
    kept = pattern._densest(times, expected, np.zeros(5), np.zeros(5))
    assert [list(one) for one in kept] == [[100.0, 101.0, 102.0], [1, 2, 3]]
