"""No impact gives the chain more than the rod brings, for α ≤ ½ and γ ≥ α/2.

With r = m/M and x = 1/(1 + γ r), Eq. 9 raises the chain's kinetic energy by

    J V + J²/(2M) = m V² · α x (1 + α (1 − x)/(2γ)).

For γ ≥ α/2 this grows with x, and x ≤ 1, so it is at most α m V²: the work of J at the speed
before the impact, and for α ≤ ½ no more than the rod's ½ m V². Eq. 10 with ξ' = ξ gives
γ = (1 + ξ)²/(4ξ) ≥ 1, so every rod chain is inside. Summed over the fall: the top rod's kinetic
energy never exceeds the potential energy of the whole chain.
"""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from rig.model.fall import hits, kicks
from rig.model.impact import gamma_finite
from tests.examples import examples
from tests.model.chains import DROPS, GRAVITIES, chains, decades

ROUNDING = 1.0 + 1e-13
INERTIAS = decades(-3, 0)
# Not subnormal: such a number has no relative precision to hold a bound to.
PULLS = st.one_of(st.just(0.0), st.floats(1e-12, 0.5))


@examples(80)
@given(chains(), PULLS, INERTIAS, DROPS, GRAVITIES)
def test_an_impact_gives_the_chain_no_more_than_the_rod_brings(
    chain, alpha, inertia, drop, gravity
):
    gains = kicks(chain, [alpha] * chain.rods, gamma_finite(inertia))
    for k, hit in enumerate(hits(chain, gains, drop, gravity)[:-1]):
        rest = math.fsum(chain.masses[k + 1 :])
        gained = rest * hit.speed_before**2 * gains[k] * (1.0 + gains[k] / 2.0)
        assert 0.0 <= gained <= alpha * chain.masses[k] * hit.speed_before**2 * ROUNDING


@examples(80)
@given(chains(), PULLS, st.floats(1.0, 10.0), DROPS, GRAVITIES)
def test_what_still_falls_never_has_more_energy_than_the_chain_had(
    chain, alpha, excess, drop, gravity
):
    gamma = max(excess * alpha / 2, 1e-12)  # down to the least γ for which this holds
    before = math.fsum(m * gravity * (drop + z) for m, z in zip(chain.masses, chain.heights,
                                                                 strict=True))  # fmt: skip
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    for k, hit in enumerate(hits(chain, gains, drop, gravity)):
        above = range(k + 1, chain.rods)
        moving = math.fsum(chain.masses[j] for j in above) * hit.speed_after**2 / 2
        height = chain.heights[k]
        lifted = math.fsum(chain.masses[j] * gravity * (chain.heights[j] - height) for j in above)
        assert moving + lifted <= before * ROUNDING
    assert chain.masses[-1] * hit.speed_before**2 / 2 <= before * ROUNDING
