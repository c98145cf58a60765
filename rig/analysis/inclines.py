"""Whether the impacts of a drop are those of another of the plan's inclines than the run's own.

What a single drop tells is α. It cannot tell a board at another angle from a surface that is not
as stated, so both are said, and the drop stays good: its Δz and V are what they are.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.errors import DomainError
from rig.model.predict import expected_alpha
from rig.reasons import Reason, make_reason

if TYPE_CHECKING:
    from rig.analysis.fit import Fit
    from rig.protocol.protocol import Run

CLEAR = math.log(1000.0)
"""Log odds by which another incline must be likelier."""
_FITS = 2.0  # standard uncertainties within which α is another incline's
_MODEL = 0.15
"""Of α, one standard deviation of what the model may be off: resolved rods give up to 40 % more."""


def other_incline(fit: Fit, run: Run) -> tuple[Reason, ...]:
    """Say of which other incline the impacts are; nothing where they may well be of the run's."""
    model, estimate, incline = fit.model, fit.estimate, run.incline_deg
    surface = model.protocol.surface
    if surface is None or incline is None or "alpha" not in model.unknowns:
        return ()
    at = model.unknowns["alpha"]
    alpha = model.guesses["impact"].alpha + float(estimate.x[at][0])
    u = float(estimate.own_u[at][0])
    chain = model.records["impact"].chain.chain

    def off(incline_deg: float) -> tuple[float, float]:
        """How far α is from that of an incline, relative to the standard deviation; and ln p."""
        expected = expected_alpha(chain, surface, incline_deg)
        sd = math.hypot(u, expected.u, _MODEL * expected.value)
        far = abs(alpha - expected.value) / sd
        return far, -0.5 * far**2 - math.log(sd)

    likely: dict[float, tuple[float, float]] = {}
    for angle in dict.fromkeys((incline, *model.protocol.plan.inclines)):
        try:
            likely[angle] = off(angle)
        except DomainError:
            continue
    if incline not in likely or len(likely) < 2:
        return ()
    best = max(likely, key=lambda angle: likely[angle][1])
    if likely[best][0] > _FITS or likely[best][1] - likely[incline][1] < CLEAR:
        return ()
    return (
        make_reason(
            "other_incline", alpha=alpha, U95=2.0 * u, likelier_deg=best, stated_deg=incline
        ),
    )
