"""Agreement of a session's falls with the model, from the variance components of a joint fit."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.plain_data import attributes

if TYPE_CHECKING:
    from rig.analysis.joint_fit import JointFit

LIKE_DEPARTURE = 50e-6
"""Least departure that counts as a difference, m: half of an edge's unmodelled scatter."""
ENOUGH = 20.0
"""Least degrees of freedom of a meaningful scatter."""
LIKE_IMPULSES = 0.1
"""Least scatter of single impulses, relative to α, that counts as a difference."""
_LEAST_MM = 0.01  # below the resolution that a sentence states


class Likeness(NamedTuple):
    """Differences between a session's falls and Eqs. 8 to 13.

    Attributes
    ----------
    departure
        Standard deviation of rods from their chain once rods have struck, m.
    impulses
        Scatter of single impulses, relative to α; `None` if the drops do not determine it.
    """

    departure: float
    impulses: float | None

    @property
    def like(self) -> bool:
        """Whether both differences are small."""
        return self.departure < LIKE_DEPARTURE and (self.impulses or 0.0) < LIKE_IMPULSES

    @property
    def sentence(self) -> str:
        """The comparison in words."""
        size = f"{max(self.departure * 1e3, _LEAST_MM):.2f} mm"
        impulses = self.impulses
        vary = "" if impulses is None else f"; single impacts vary by {100.0 * impulses:.0f} %"
        if self.like:
            return f"Measured positions match the model to {size}{vary}."
        return (
            f"Measured positions differ from the model by {size} (one standard deviation){vary}."
            " Results and their ± allow for this; β, μ and γ do not."
        )

    def json(self) -> dict[str, Any]:
        """Return ``{"like_model", "departure_m", "impulses", "sentence"}``."""
        return attributes(self, "like_model=like", "departure_m=departure", "impulses", "sentence")


def likeness(joint: JointFit) -> Likeness | None:
    """Return the likeness of a session's falls; `None` without strikes, or with too few edges."""
    alpha = median([abs(drop.model.alpha) for drop in joint.drops])
    scales, degrees = joint.components, joint.degrees
    if alpha <= 0.0 or degrees.get("departure", 0.0) < ENOUGH:
        return None
    scatter = math.hypot(scales.impulse, scales.impulse_floor / alpha)
    return Likeness(scales.departure, scatter if degrees.get("impulse", 0.0) >= ENOUGH else None)
