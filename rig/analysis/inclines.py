"""Check whether the impacts of a drop match another incline of the plan.

A single drop gives only α. That does not separate a board at another angle from a surface that
differs from the protocol. So the reason mentions both, and the drop stays good: its Δz and V are
valid.
"""

import math
from collections.abc import Iterator
from contextlib import suppress

from rig.analysis.fit import Fit
from rig.analysis.identify import LEAD
from rig.analysis.last_passages import APART
from rig.errors import DomainError
from rig.model.predict import expected_alpha
from rig.protocol.protocol import Run
from rig.reasons import Reason, make_reason

_MODEL = 0.15
"""Relative standard uncertainty of the model's α: resolved rods give up to 40 % more."""


def other_incline(fit: Fit, run: Run) -> Iterator[Reason]:
    """Yield the reason that names a clearly likelier incline, if there is one."""
    model, stated, surface = fit.model, run.incline_deg, fit.model.protocol.surface
    if surface is None or stated is None or "alpha" not in model.unknowns:
        return
    alpha = float(fit.x[model.unknowns["alpha"]][0])
    u = float(fit.estimate.own_u[model.unknowns["alpha"]][0])
    fits: dict[float, tuple[float, float]] = {}  # ln p of α, and its deviation in units of sd
    for angle in (stated, *model.protocol.plan.inclines):
        with suppress(DomainError):
            expected = expected_alpha(model.records["impact"].chain.chain, surface, angle)
            sd = math.hypot(u, expected.u, _MODEL * expected.value)
            far = abs(alpha - expected.value) / sd
            fits[angle] = -0.5 * far**2 - math.log(sd), far
    best = max(fits, key=lambda angle: fits[angle], default=stated)
    if stated in fits and fits[best][1] < APART and fits[best][0] > fits[stated][0] + LEAD:
        values = {"alpha": alpha, "U95": 2.0 * u, "likelier_deg": best, "stated_deg": stated}
        yield make_reason("other_incline", model.protocol.vocabulary, **values)
