"""Impact coefficients rod by rod, for chains whose rods differ."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rig.model.chain import sums_above
from rig.model.impact import Impact, gamma_finite, impact_on

if TYPE_CHECKING:
    from rig.model.chain import Chain
    from rig.model.surface import Surface


def rod_impacts(surface: Surface, chain: Chain, incline_deg: float) -> list[Impact]:
    """α and γ of each rod, bottom up; the top rod's impact pulls on nothing.

    α follows from the rod's own ξ (Eqs. 8, 12 and 13). In γ, ξ is that of the striking rod and
    ξ' = 4I'/(ML²) that of all rods above it turning together (Eq. 10 and section S II): with rods
    of one length, the mean of their ξ weighted by mass.

    Raises
    ------
    DomainError
        Where Eq. 13 has no finite solution for one of the rods.
    """
    if chain.inertias is None:
        return [impact_on(surface, chain, incline_deg)] * chain.rods
    moments = [m * xi for m, xi in zip(chain.masses, chain.inertias, strict=True)]
    sums = zip(sums_above(moments), sums_above(chain.masses), strict=True)
    above = [moment / mass for moment, mass in sums]
    impacts = []
    for xi, xi_above in zip(chain.inertias, [*above, chain.inertias[-1]], strict=True):
        impact = impact_on(surface, replace(chain, inertia=xi, inertias=None), incline_deg)
        if chain.alpha is None and chain.gamma is None:
            impact = replace(impact, gamma=gamma_finite(xi, xi_above))
        impacts.append(impact)
    return impacts
