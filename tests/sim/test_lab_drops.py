"""Chance in single drops: release, impulses, and what the beams make of rods and string."""

import math

import pytest

from sim.beam import NOT_A_ROD
from sim.truth import Truth
from tests.sim.chance import (
    FEW_GATES,
    FREE,
    assert_normal,
    attempts,
    with_dials,
)
from tests.sim.falls import DELAY, RODS, UNIFORM, WITHOUT_GATES, ByHand, alpha

G = 9.81


def late(truth: Truth, quiet: Truth) -> tuple[float, float]:
    """How much later each side's edges come than in a quiet drop: one value a side."""
    found = []
    for free in (False, True):
        now, then = (
            sorted((c, r, b, t) for t, c, b, r in x.edges if (c in FREE) == free)
            for x in (truth, quiet)
        )
        lags = [a[3] - b[3] for a, b in zip(now, then, strict=True)]
        assert max(lags) - min(lags) < 1e-12
        found.append(lags[0])
    return found[0], found[1]


def test_a_positive_skew_is_a_free_chain_that_leaves_later():
    (quiet,) = attempts(with_dials(), 1, FEW_GATES)
    drops = attempts(with_dials(skew_sd=4e-3), 300, FEW_GATES)
    fall = float(ByHand.at(40).times[-1])
    for truth in drops:
        struck, free = late(truth, quiet)
        skew = truth.release_skew_s
        assert struck == 0.0
        assert free == pytest.approx(skew, abs=1e-12)
        # At the hit the free chain has fallen for `fall - skew`: later means higher.
        raised = G * fall * skew - G * skew**2 / 2
        assert truth.separation_raw_m - truth.separation_m == pytest.approx(raised, abs=1e-12)
        assert truth.separation_m == pytest.approx(quiet.separation_m, rel=1e-12)
    assert pytest.approx(4.9e-3, rel=0.01) == G * fall * 1e-3  # 4.9 mm a millisecond
    assert_normal([t.release_skew_s for t in drops], 4e-3)


def test_the_top_rod_strikes_what_lies_there():
    drops = attempts(with_dials(strike_sd=5e-3), 300, FEW_GATES)
    above = []
    for truth in drops:
        end, strike = truth.speed_m_s, truth.speed_strike_m_s
        above.append((end**2 - strike**2) / (2 * G))
        # While the rod would fall on, the free chain comes nearer with the speed that it has then.
        early = 2 * above[-1] / (end + strike)
        free = G * (truth.fall_time_s - 0.5 * early)
        higher = free * early - above[-1]
        assert truth.separation_strike_m == pytest.approx(truth.separation_m + higher, rel=1e-9)
    assert_normal(above, 5e-3)


def test_single_impulses_scatter_independently_by_the_dial():
    sd, wiggle = 0.02, 1e-6
    a = alpha(40)
    level = ByHand([a] * RODS).separation
    slopes = [
        float(ByHand([a * (1 + wiggle * (k == rod)) for k in range(RODS)]).separation - level)
        / wiggle
        for rod in range(RODS)
    ]
    drops = attempts(with_dials(impulse_sd=sd), 300, WITHOUT_GATES)
    assert_normal([t.separation_m - float(level) for t in drops], sd * math.hypot(*slopes))


@pytest.mark.parametrize("true", [{"restitution": 0.6}, {"friction": 0.25}])
def test_true_coefficients_may_differ_from_the_protocol_s(true):
    (name, value), *_ = true.items()
    by_hand = ByHand.at(40, **{{"restitution": "beta", "friction": "mu"}[name]: str(value)})
    truth = attempts(with_dials(**true), 1)[0]
    assert truth.separation_m == pytest.approx(float(by_hand.separation), rel=1e-12)
    assert truth.speed_m_s == pytest.approx(float(by_hand.before[-1]), rel=1e-12)


def test_rods_bounce_through_the_lowest_beam_of_the_impact_side_alone():
    truth = attempts(with_dials(bounce=1.0), 1)[0]
    bounces = [edge for edge in truth.edges if edge[3] == NOT_A_ROD]
    assert {channel for _, channel, _, _ in bounces} == {0}
    hits = [DELAY + float(t) for t in ByHand.at(40).times]
    assert 2 <= len(bounces) <= 2 * RODS  # many merge with the next rods' shadows
    assert min(t for t, *_ in bounces) > hits[0] + 4e-3
    assert max(t for t, *_ in bounces) < hits[-1] + 40e-3
    assert {edge[1] for edge in truth.edges if edge[0] > hits[-1] + 1e-3 and edge[1] < 8} == {0}


def test_the_string_flickers_in_gaps_between_rods():
    quiet = attempts(with_dials(), 1)[0]
    truth = attempts(with_dials(string=1.0), 1)[0]
    flickers = [edge for edge in truth.edges if edge[3] == NOT_A_ROD]
    for channel in (gate.channel for gate in UNIFORM.gates.gates):
        rods = {rod for _, at, _, rod in quiet.edges if at == channel}
        begun = [edge for edge in flickers if edge[1] == channel and edge[2]]
        # A flicker that runs into the next rod ends with it; it still begins by itself.
        assert len(begun) == len(rods) - 1
        gaps = [edge for edge in quiet.edges if edge[1] == channel][1:-1]
        for (time, *_), (last, *_), (following, *_) in zip(
            begun, gaps[::2], gaps[1::2], strict=True
        ):
            assert last < time < following
