"""Many falls at once are the falls one at a time, to the last bit."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import DomainError
from rig.model import batch
from rig.model.batch import falls, given_impacts, surface_impacts
from rig.model.fall import fall
from rig.model.impact import impact_on
from rig.model.surface import Pile, Surface
from rig.units import Quantity
from tests.examples import examples
from tests.model.chains import ALPHAS, DROPS, GAMMAS, GRAVITIES, SPEEDS, chains, close, even_chain

ONE_OR_MANY = st.lists(st.tuples(ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS), min_size=1, max_size=8)


def ends(found):
    """Rows of Δz, V and t."""
    return list(zip(*(row.ravel().tolist() for row in found), strict=True))


def end(chain, alpha, gamma, drop, gravity, speed=0.0):
    found = fall(chain, alpha, gamma, drop, gravity, speed)
    return found.separation_m, found.speed_m_s, found.time_s


def falls_of(chain, rows):
    alpha, gamma, drop, gravity, speed = map(np.array, zip(*rows, strict=True))
    return falls(chain.masses, chain.heights, given_impacts(alpha, gamma), drop, gravity, speed)


@examples(150)
@given(chains(), ONE_OR_MANY)
def test_one_chain_falls_as_it_does_alone(chain, rows):
    found = falls_of(chain, rows)
    assert ends(found) == [end(chain, *row) for row in rows]


def test_arguments_broadcast_and_blocks_do_not_show(monkeypatch):
    monkeypatch.setattr(batch, "_BLOCK", 8)
    chain = even_chain(5)
    assert falls(chain.masses, chain.heights, given_impacts([]), [], 9.81).shape == (3, 0)
    alpha, drop, gravity = [[0.1], [0.2], [0.3]], [0.0, 0.1], [[[9.81]], [[1.62]]]
    found = falls(chain.masses, chain.heights, given_impacts(alpha, 1.5), drop, gravity, 0.5)
    assert found.shape == (3, 2, 3, 2)
    wanted = [
        end(chain, a, 1.5, h, g, 0.5) for g in (9.81, 1.62) for a in (0.1, 0.2, 0.3) for h in drop
    ]
    assert ends(found) == wanted


def test_where_there_is_no_answer_it_says_so_and_the_others_stay_right():
    chain = even_chain(3)
    found = falls(chain.masses, chain.heights, given_impacts([0.1, np.nan], 1.0), 0.18, 9.81)
    for row in found:
        assert np.isnan(row).tolist() == [False, True]
    assert ends(found)[0] == end(chain, 0.1, 1.0, 0.18, 9.81)


SURFACES = st.tuples(
    st.one_of(st.sampled_from([0.0, 20.0, 90.0]), st.floats(0.0, 90.0)),
    st.floats(-0.9, 1.0),
    st.one_of(st.just(0.0), st.floats(1e-6, 1.0)),
    st.floats(0.02, 1.2),
    st.floats(0.02, 0.98),
)


def weight_of_a_digit(theta_deg, mu, xi, xi_z):
    """How much the difference in Eq. 13 enlarges the relative error of its terms."""
    theta = math.radians(theta_deg)
    cos, sin = math.cos(theta), math.sin(theta)
    free = 0.25 * (1 + xi) * (1 + 1 / xi_z) * sin / (cos + mu * sin)
    return (cos + free * (sin + mu * cos)) / abs(cos + free * (sin - mu * cos))


@examples(150)
@given(st.lists(SURFACES, min_size=1, max_size=6), st.booleans(), st.booleans())
def test_impacts_are_those_of_one_surface(rows, own_z, piled):
    pile = Pile(20.0, Quantity(-0.37)) if piled else None
    theta, beta, mu, xi, xi_z = zip(*rows, strict=True)
    found = surface_impacts(theta, beta, mu, xi, inertia_z=xi_z if own_z else None, pile=pile)
    for k, row in enumerate(rows):
        chain = replace(even_chain(2), inertia=row[3], inertia_z=row[4] if own_z else None)
        surface = Surface(Quantity(row[1]), Quantity(row[2]), pile)
        weight = weight_of_a_digit(row[0], row[2], row[3], row[4] if own_z else row[3])
        try:
            impact = impact_on(surface, chain, row[0])
        except DomainError:
            assert np.isnan(found.alpha[k]) or weight > 1e14
            continue
        # With ξ > 1 Eq. 8 is negative, and near 1 all its digits are those of 1 − ξ.
        assert found.gamma[k] == impact.gamma
        assert close(found.alpha[k], impact.alpha, 2e-15 * weight) or weight > 1e14
        if abs(row[0] - math.degrees(math.atan(row[2]))) > 1e-12:
            assert found.sliding[k] == ("does not slide" not in "".join(impact.notes))
