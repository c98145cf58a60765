"""The simulated lab with nothing disturbed is the model, edge by edge; and it is reproducible."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import InputError
from rig.link.messages import pack_label
from sim.dials import Dials
from sim.lab import ChainLab
from sim.truth import Truth
from tests.examples import examples
from tests.refusals import refused
from tests.sim.falls import DELAY, UNIFORM, ByHand, crossings, free_time_down

QUIET = Dials.quiet()
RUN_OF = {run.incline_deg: number for number, run in ChainLab(UNIFORM, QUIET, 0).runs.items()}


def drop(protocol, dials=QUIET, seed=1, run=1, attempt=1) -> tuple[list, Truth]:
    told: list[Truth] = []
    edges = ChainLab(protocol, dials, seed, told.append).drop(pack_label(run, attempt))
    (truth,) = told
    return edges, truth


def on(edges, channel: int) -> list[tuple[float, bool]]:
    return [(time, blocked) for time, at, blocked in edges if at == channel]


def exactly(value):
    return pytest.approx(float(value), rel=1e-12)


@pytest.mark.parametrize("incline", [0, 20, 30, 40, 60, 80])
def test_every_quiet_edge_is_where_the_equations_put_it(incline):
    edges, truth = drop(UNIFORM, run=RUN_OF[incline])
    by_hand = ByHand.at(incline)
    assert truth.separation_m == truth.separation_raw_m == exactly(by_hand.separation)
    assert truth.speed_m_s == exactly(by_hand.before[-1])
    assert truth.fall_time_s == exactly(by_hand.times[-1])
    assert (truth.incline_deg, truth.release_skew_s) == (incline, 0.0)
    expected = 0
    for gate in UNIFORM.gates.gates:
        time_down = by_hand.time_down if gate.side == "impact" else free_time_down
        crossed = crossings(gate.height, time_down)
        seen = on(edges, gate.channel)
        assert [blocked for _, blocked in seen] == [blocked for _, blocked, _ in crossed]
        assert [t for t, _ in seen] == pytest.approx([DELAY + t for t, _, _ in crossed], abs=1e-12)
        expected += len(crossed)
    assert len(edges) == expected
    assert [e[0] for e in edges] == sorted(e[0] for e in edges)


def test_hanging_chains_leave_the_beams_free_unless_hung_too_low():
    label = pack_label(1, 1)
    assert ChainLab(UNIFORM, Dials(), 1).rest(label) == 0
    lab = ChainLab(UNIFORM, QUIET, 1)
    lab.hang_height = 0.130  # bottom rods right in the beams of channels 3 …
    gates = {gate.channel: gate.height for gate in UNIFORM.gates.gates}
    blocked = {
        channel
        for channel, height in gates.items()
        if any(abs(0.130 + 1.165 * k / 24 - height) < 0.0127 / 2 for k in range(25))
    }
    assert 3 in blocked
    assert lab.rest(label) == sum(1 << channel for channel in blocked)


labels = st.tuples(st.integers(1, 108), st.integers(1, 3))


@examples(6)
@given(st.lists(labels, min_size=1, max_size=3), st.randoms(use_true_random=False))
def test_a_drop_depends_on_seed_run_and_attempt_alone(asked, order: random.Random):
    lab = ChainLab(UNIFORM, Dials(), 3)
    first = {label: lab.drop(pack_label(*label)) for label in asked}
    again = [*asked, *asked]
    order.shuffle(again)
    other = ChainLab(UNIFORM, Dials(), 3)
    for label in again:
        assert other.drop(pack_label(*label)) == first[label]


def test_a_run_the_plan_does_not_have_is_bad_input():
    lab = ChainLab(UNIFORM, QUIET, 1)
    for ask in (lab.drop, lab.rest):
        refused(InputError, "no run 109", ask, pack_label(109, 1))
