"""Can a rod's impact send waves up the chain? The argument of section III.D.

On an incline an impact also swings the chain sideways and twists it. The paper leaves both out
because the chain comes down faster than these waves run up it: √α V for transverse waves and
√(α/ξ) V for torsional ones, with the tension of Eq. 2 at the impact.

The text gives √0.1 V and √0.3 V as typical. The torsional one is below V only where α < ξ. By
Eqs. 12 and 13 α falls off like ξ as ξ → 0, but with a factor above 1 where the incline is
moderate, so that the left end of Fig. 6 is outside this argument: at 40° (β = 0.5, μ = 0.2)
torsional waves outrun the chain for ξ < 0.160, at up to 1.81 V.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rig.errors import DomainError


@dataclass(frozen=True, slots=True)
class Waves:
    """Wave speeds just above the impact, in units of the chain's speed V.

    Attributes
    ----------
    transverse
        √α.
    torsional
        √(α/ξ).
    notes
        Every wave that is not slower than the chain; empty where the argument holds.
    """

    transverse: float
    torsional: float
    notes: tuple[str, ...] = ()


def waves(alpha: float, inertia: float) -> Waves:
    """Wave speeds on a chain with the tension of Eq. 2, and whether the chain outruns them.

    Parameters
    ----------
    inertia
        ξ about the vertical axis.

    Raises
    ------
    DomainError
        For α < 0 (a chain under pressure carries no such waves) or ξ ≤ 0.
    """
    if not alpha >= 0.0 or not inertia > 0.0:
        raise DomainError(
            f"no waves at alpha {alpha:g} and inertia {inertia:g}: "
            "alpha must not be negative and inertia must be above zero"
        )
    found = {"transverse": math.sqrt(alpha), "torsional": math.sqrt(alpha / inertia)}
    notes = tuple(
        f"{kind} waves run at {ratio:.3g} V, not slower than the chain: what is above the impact "
        "does not stay as it was"
        for kind, ratio in found.items()
        if ratio >= 1.0
    )
    return Waves(found["transverse"], found["torsional"], notes)
