"""Annealing finds the fall in real records and none elsewhere; what begins is near."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.annealing import ALPHA, RELEASE, START, UNKNOWNS, SideFall
from rig.analysis.identify import adjusted, stated_model
from rig.analysis.verdict import LEAD, SUPPORT
from rig.model.impact import impact_on
from rig.protocol.protocol import Protocol
from rig.records import Edge
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import CLOCK_U, FENCE, HZ, SCENES, STATED, UNIFORM, Case, case, codes
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


def falls_of(one: Case, protocol: Protocol | None = None) -> list[SideFall]:
    """What annealing knows of each side."""
    protocol = protocol or one.protocol
    model = stated_model(protocol, one.records, CLOCK_U, STATED)
    return [SideFall.of(model, role) for role in model.records]


@pytest.mark.parametrize("scene", SCENES)
def test_the_first_start_is_the_fall(scene):
    """All rods at all beams vote for where the chain really began, to a part of their distance."""
    one = case(SCENES[scene], replace(Dials.quiet(), delay=DELAY))
    for fall in falls_of(one):
        starts, votes = max(fall.starts(), key=lambda batch: batch[1].max(initial=0))
        assert votes[0] >= fall.record.expected
        assert abs(starts[0, RELEASE] - DELAY) * 8.0 < 3.0 * fall.slack
        alpha = 0.0
        if fall.record.ratios is not None:
            chain = fall.record.chain.chain
            alpha = impact_on(one.protocol.surface, chain, one.run.incline_deg).alpha
        assert abs(starts[0, ALPHA] * fall.sd[ALPHA] + fall.stated.alpha - alpha) < 0.05


def test_votes_are_only_counted_where_a_release_may_be():
    for fall in falls_of(RECORD):
        ((best, *_), (most, *_)) = next(fall.starts())
        for begin, end in ((-0.01, 0.01), (0.02, 0.2)):
            window = best[RELEASE] + begin, best[RELEASE] + end
            starts, votes = next(fall.starts(window))
            assert all(window[0] - 0.01 < start[RELEASE] < window[1] + 0.01 for start in starts)
            assert (max(votes) > 0.95 * most) == (begin < 0.0)
        assert not next(fall.starts((-np.inf, -60.0)))[1].size


def test_no_chain_begins_below_what_it_strikes():
    """A drop stated so badly that some starts within its uncertainty are no starts."""
    low = replace(UNIFORM, drop=Quantity(0.01, 0.01))
    for fall in falls_of(RECORD, low):
        start = 0.01 + fall.nodes()[:, START] * fall.sd[START]
        assert len(np.unique(start)) > 1
        assert (start > 0.0).all()


def test_what_is_likeliest_is_tried_first():
    """And nothing further off than any edge could tell."""
    for fall in falls_of(RECORD, replace(UNIFORM, drop=Quantity(0.18, 0.02))):
        off = fall.nodes()
        unlikely = (off**2).sum(axis=1)
        assert unlikely[0] < 1e-6  # in air there is no less than next to none
        assert (np.diff(unlikely) > -1e-9).all()
        assert len(np.unique(off, axis=0)) == len(off) > 1


@pytest.mark.parametrize("scene", SCENES)
def test_derivatives_are_those_of_the_heights(scene):
    """Of every unknown, at falls that differ, beside differences of twice the size."""
    rng = np.random.default_rng(3)
    for fall in falls_of(case(SCENES[scene], Dials.quiet())):
        falls = 0.3 * rng.uniform(0.1, 1.0, (4, UNKNOWNS)) * (fall.sd > 0.0)
        falls[:, RELEASE] = 0.02
        slopes = fall.sights(falls)[2]
        for name in np.flatnonzero(fall.sd > 0.0):
            step = np.zeros(UNKNOWNS)
            step[name] = 2e-5 if name == RELEASE else 1e-3
            up, down = (fall.sights(falls + sign * step)[0] for sign in (1, -1))
            assert np.median(np.abs((up - down) / (2.0 * step[name]) - slopes[..., name])) < (
                1e-5 * np.abs(slopes[..., name]).max() + 1e-9
            )


def test_falls_together_are_as_each_alone():
    """However many begin at once, each finds what it would by itself."""
    for fall in falls_of(RECORD):
        starts, _ = next(fall.starts())
        best = max(fall.anneal(starts), key=lambda reading: reading.evidence)
        alone = max(fall.anneal(starts[:1]), key=lambda reading: reading.evidence)
        np.testing.assert_array_equal(best.edges, alone.edges)
        assert best.evidence == pytest.approx(alone.evidence, abs=0.5)


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
