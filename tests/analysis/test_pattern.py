"""The first guess finds the fall in real records, and finds none where there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.pattern import ALPHAS
from rig.analysis.verdict import LEAD, SUPPORT
from rig.model.impact import impact_on
from rig.records import Edge
from sim.dials import Dials
from tests.analysis.drops import FENCE, HZ, SCENES, UNIFORM, Case, case
from tests.examples import examples

DELAY = 0.020
KNOWN = Dials(delay=DELAY, delay_sd=0.0)  # so that the truth knows the release times
RECORD = case(UNIFORM, Dials.quiet(), incline=40.0)


def assert_found(one: Case) -> None:
    """Release and α good enough to tell rods apart, with support that no pile of edges has."""
    chain = next(iter(one.protocol.chains.values())).chain
    pitch = float(np.diff(chain.heights).min())
    skew = one.truth.release_skew_s or 0.0
    for role, found in one.guesses().items():
        late = found.release - DELAY - (skew if role == "free" else 0.0)
        # The fastest chain is at 8 m/s; a twelfth of the pitch leaves no doubt which rod it is.
        assert abs(late) * 8.0 < pitch / 12
        assert abs(found.start - one.protocol.drop.value) < pitch / 12
        assert found.share > 0.9
        assert found.share - found.runner_up > LEAD
        if role == "impact":
            impact = impact_on(one.protocol.surface, chain, one.run.incline_deg)
            # The step of α, and the mean of the impulses' own scatter of 2 %.
            assert abs(found.alpha - impact.alpha) < 0.01 + 0.02 * impact.alpha
        else:
            assert found.alpha == 0.0


@pytest.mark.parametrize("incline", [0.0, 30.0, 40.0, 60.0, 80.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_guess_finds_every_incline(incline, seed):
    assert_found(case(UNIFORM, KNOWN, incline=incline, seed=seed))


@pytest.mark.parametrize("scene", ["graded", "single", "fence"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_guess_finds_every_scene(scene, seed):
    assert_found(case(SCENES[scene], KNOWN, seed=seed))


@pytest.mark.parametrize("skew", [-12e-3, -4e-3, 4e-3, 12e-3])
def test_the_guess_finds_each_side_by_itself_however_late(skew):
    # The skew is a normal number times the dial: the seed's own number, asked for first.
    unit = case(UNIFORM, replace(Dials.quiet(), skew_sd=1.0), incline=40.0).truth.release_skew_s
    assert_found(case(UNIFORM, replace(KNOWN, skew_sd=skew / unit), incline=40.0))


def test_alpha_is_found_to_a_step():
    for restitution in (0.0, 0.2, 0.8):
        dials = replace(Dials.quiet(), restitution=restitution)
        one = case(UNIFORM, dials, incline=40.0)
        chain = UNIFORM.chains["A"].chain
        true = impact_on(UNIFORM.surface, chain, 40.0, restitution=restitution).alpha
        assert abs(one.guesses()["impact"].alpha - true) <= np.diff(ALPHAS).max()


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


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_pile_of_edges_looks_like_no_chain(share, seed):
    one = pile(RECORD, round(share * len(RECORD.drop.edges)), seed)
    found = one.guesses()
    assert found["impact"].share < SUPPORT - 0.2
    assert found["free"].share < SUPPORT
    result = one.analyze()
    assert result.verdict == "void"
    assert any("does not look like this chain falling" in reason for reason in result.reasons)


@examples(40)
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
