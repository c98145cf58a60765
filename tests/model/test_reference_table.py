"""The table of reference values in the project's physics notes, worked out with 60 digits."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from mpmath import mp

from rig.model.chain import Chain
from rig.model.fall import fall, free_fall_speed, hits, kicks
from rig.model.impact import alpha_inclined, alpha_level, gamma_finite, impact_on
from rig.model.predict import predict
from rig.protocol.reader import read
from tests.model.chains import even_chain
from tests.model.reference import printed_alpha, reference_fall

PROTOCOLS = Path(__file__).parents[2] / "protocols"
DROP, GRAVITY = 0.18, 9.81
# incline (deg), α, Δz (m), V (m/s), t (s)
TABLE = [
    (0, "0.25", "0.17762380452368596", "8.3678802518552439", "0.48784955224134661"),
    (30, "0.19834747713266998", "0.14455777135466808", "7.5511640917900483", "0.49471049795616742"),
    (40, "0.15506060950816171", "0.11546810526538031", "6.9327596650855757", "0.50066864460340956"),
    (
        60,
        "0.068911961660286844",
        "0.053585554933341692",
        "5.8609487859073973",
        "0.51311334995443199",
    ),
    (
        80,
        "0.01226400922538273",
        "0.0098142050953198042",
        "5.2579813110300101",
        "0.52173665052246976",
    ),
]
PILE_ALPHA, PILE_SEPARATION, PILE_SPEED = 0.105, 0.080175519527158543, 6.2857634799081311
GRADED_SEPARATION, GRADED_SPEED = 0.20034710240655192, 8.0478400772111967


def exactly(value):
    return pytest.approx(float(value), rel=1e-12, abs=0)


def scene(name):
    protocol = read(PROTOCOLS / f"{name}.yaml")
    return protocol, next(iter(protocol.chains.values())).chain


def graded_chain() -> Chain:
    diameters = [d for d in (0.032, 0.025, 0.019, 0.013, 0.0063) for _ in range(4)]
    gap = (1.165 - sum(diameters) + (diameters[0] + diameters[-1]) / 2) / 19
    heights = [0.0]
    for lower, upper in pairwise(diameters):
        heights.append(heights[-1] + lower / 2 + gap + upper / 2)
    return Chain(tuple(d * d for d in diameters), tuple(heights))


@pytest.mark.parametrize(("incline", "alpha", "separation", "speed", "time"), TABLE)
def test_built_directly(incline, alpha, separation, speed, time):
    found_alpha = alpha_inclined(0.5, 0.2, incline)
    end = fall(even_chain(25), found_alpha, gamma_finite(1 / 3), DROP, GRAVITY)
    assert found_alpha == exactly(alpha)
    assert end.separation_m == exactly(separation)
    assert end.speed_m_s == exactly(speed)
    assert end.time_s == exactly(time)


@pytest.mark.parametrize(("incline", "alpha", "separation", "speed", "time"), TABLE)
def test_read_from_the_protocol(incline, alpha, separation, speed, time):
    protocol, chain = scene("inclined-uniform")
    bare = replace(protocol.surface, pile=None)
    found = predict(chain, bare, incline, protocol.drop, protocol.gravity)
    assert found.in_domain
    assert found.alpha == exactly(alpha)
    assert found.separation == exactly(separation)
    assert found.speed == exactly(speed)
    assert found.time == exactly(time)


@pytest.mark.parametrize("incline", [0.0, 10.0, 20.0, 29.999])
def test_below_30_degrees_the_protocol_means_the_pile(incline):
    protocol, chain = scene("inclined-uniform")
    found = predict(chain, protocol.surface, incline, protocol.drop, protocol.gravity)
    assert found.alpha == exactly(PILE_ALPHA)
    assert found.separation == exactly(PILE_SEPARATION)
    assert found.speed == exactly(PILE_SPEED)


def test_pile_built_directly():
    alpha = alpha_level(-0.37)
    end = fall(even_chain(25), alpha, gamma_finite(1 / 3), DROP, GRAVITY)
    assert alpha == exactly(PILE_ALPHA)
    assert end.separation_m == exactly(PILE_SEPARATION)
    assert end.speed_m_s == exactly(PILE_SPEED)


def test_graded_chain_built_directly():
    end = fall(graded_chain(), alpha_inclined(0.5, 0.2, 40), gamma_finite(1 / 3), DROP, GRAVITY)
    assert end.separation_m == exactly(GRADED_SEPARATION)
    assert end.speed_m_s == exactly(GRADED_SPEED)


def test_graded_chain_read_from_the_protocol():
    protocol, chain = scene("graded-chain")
    found = predict(chain, protocol.surface, 40, protocol.drop, protocol.gravity)
    assert found.in_domain
    assert found.separation == exactly(GRADED_SEPARATION)
    assert found.speed == exactly(GRADED_SPEED)


@pytest.mark.parametrize(("incline", "alpha", "separation", "speed", "time"), TABLE)
def test_the_second_implementation_gives_the_table_to_its_last_digit(
    incline, alpha, separation, speed, time
):
    with mp.workdps(50):
        thirds, beta, mu = mp.mpf(1) / 3, mp.mpf("0.5"), mp.mpf("0.2")
        exact = printed_alpha(beta, mu, incline, thirds) if incline else mp.mpf("0.25")
        heights = [mp.mpf("1.165") * k / 24 for k in range(25)]
        drop, gravity = mp.mpf("0.18"), mp.mpf("9.81")
        end = reference_fall([1] * 25, heights, exact, mp.mpf(4) / 3, drop, gravity, digits=50)
        for found, wanted in zip((exact, *end), (alpha, separation, speed, time), strict=True):
            assert abs(found / mp.mpf(wanted) - 1) < 1e-16


def at_40(beta=0.5, mu=0.2, drop=DROP, length=1.165):
    return fall(
        even_chain(25, length), alpha_inclined(beta, mu, 40), gamma_finite(1 / 3), drop, GRAVITY
    )


@pytest.mark.parametrize(
    ("change", "separation_mm", "speed"),
    [
        ({"beta": 0.55}, 3.5, 0.071),
        ({"mu": 0.25}, 4.6, 0.093),
        ({"drop": 0.19}, 0.3, None),
        ({"length": 1.175}, 0.9, None),
    ],
)
def test_sensitivities_at_40_degrees_as_the_notes_round_them(change, separation_mm, speed):
    base, moved = at_40(), at_40(**change)
    assert abs((moved.separation_m - base.separation_m) * 1e3 - separation_mm) <= 0.05
    if speed is not None:
        assert abs(moved.speed_m_s - base.speed_m_s - speed) <= 0.0005


def test_speeds_before_the_last_three_impacts_as_the_notes_round_them():
    chain = even_chain(25)
    gains = kicks(chain, [alpha_inclined(0.5, 0.2, 40)] * 25, gamma_finite(1 / 3))
    events = hits(chain, gains, DROP, GRAVITY)
    assert [round(hit.speed_before, 2) for hit in events[-3:]] == [6.08, 6.44, 6.93]


def test_where_the_paper_says_otherwise_the_equations_are_followed():
    friction_at_80 = alpha_inclined(0.5, 0.2, 80) / alpha_inclined(0.5, 0.0, 80)
    friction_at_40 = alpha_inclined(0.5, 0.2, 40) / alpha_inclined(0.5, 0.0, 40)
    assert round(friction_at_80, 3) == 2.153  # 2.25 in the text
    assert round(friction_at_40, 4) == 1.2025
    assert round(free_fall_speed(even_chain(25), DROP, GRAVITY), 3) == 5.137  # 5.08 in the text


def test_bead_chain_takes_its_alpha_as_given():
    protocol, chain = scene("bead-chain")
    impact = impact_on(protocol.surface, chain, 0.0)
    assert (impact.alpha, impact.gamma, impact.basis) == (0.12, 0.0, "given")
    found = predict(chain, protocol.surface, 0.0, protocol.drop, protocol.gravity)
    end = reference_fall(
        chain.masses, chain.heights, 0.12, 0, protocol.drop.value, protocol.gravity.value
    )
    assert found.separation == exactly(end.separation)
    assert found.speed == exactly(end.speed)
