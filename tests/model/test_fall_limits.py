"""Limits in which the discrete fall has a closed form."""

from __future__ import annotations

import math

from hypothesis import given

from rig.model.fall import fall
from tests.examples import examples
from tests.model.chains import DROPS, GAMMAS, GRAVITIES, chains, close


@examples(80)
@given(chains(mass_decades=2), GAMMAS, DROPS, GRAVITIES)
def test_small_alpha_is_linear(chain, gamma, drop, gravity):
    """To first order rod j, struck at free-fall speed V_j, gives ΔV_j (T − t_j) of separation.

    With V = √(2 g z) and t = √(2 z/g) for a fall of z, gravity drops out.
    """
    total = drop + chain.length
    wanted = 0.0
    for j, height in enumerate(chain.heights[:-1]):
        m, rest, fallen = chain.masses[j], math.fsum(chain.masses[j + 1 :]), drop + height
        later = (chain.length - height) / (math.sqrt(total) + math.sqrt(fallen))
        wanted += 2.0 * m / (rest + gamma * m) * math.sqrt(fallen) * later
    for alpha in (1e-25, 1e-20):
        assert close(fall(chain, alpha, gamma, drop, gravity).separation_m / alpha, wanted, 1e-13)
