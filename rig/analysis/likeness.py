"""Does a session's fall look like the model? By what a joint fit had to allow for."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.analysis.plain_data import attributes

if TYPE_CHECKING:
    from rig.analysis.joint_fit import JointFit

LIKE_DEPARTURE = 50e-6
"""Least departure that is remarked, m: half of what an edge may be off anyhow."""
ENOUGH = 20.0
"""Degrees of freedom from which on a scatter that was found means something."""
LIKE_IMPULSES = 0.1
"""Scatter of single impulses, relative to α, that is remarked: a tenth of what is explained."""
_LEAST_MM = 0.01  # below the resolution that a sentence states


class Likeness(NamedTuple):
    """How far a session's falls are from Eqs. 8 to 13.

    Attributes
    ----------
    departure
        How far off its chain a rod was once rods had struck, one standard deviation, m.
    impulses
        Scatter of single impulses, relative to α; `None` where the drops do not tell it.
    """

    departure: float
    impulses: float | None

    @property
    def like(self) -> bool:
        """Whether neither is remarkable."""
        return self.departure < LIKE_DEPARTURE and (self.impulses or 0.0) < LIKE_IMPULSES

    @property
    def sentence(self) -> str:
        """The comparison in words."""
        size = f"{max(self.departure * 1e3, _LEAST_MM):.2f} mm"
        impacts = ""
        if self.impulses is not None:
            impacts = f"; single impacts vary by {100 * self.impulses:.0f} %"
        if self.like:
            return f"Measured positions match the model to {size}{impacts}."
        return (
            f"Measured positions differ from the model by {size} (one standard deviation){impacts}."
            " Results and their ± allow for this; β, μ and γ do not."
        )

    def json(self) -> dict[str, Any]:
        """``{"like_model", "departure_m", "impulses", "sentence"}``."""
        fields = {"like_model": self.like, "departure_m": self.departure}
        return fields | attributes(self, "impulses", "sentence")


def likeness(joint: JointFit) -> Likeness | None:
    """Judge the falls of a session; `None` where none strikes, or too few edges tell."""
    alphas = [
        abs(drop.model.guesses["impact"].alpha)
        for drop in joint.drops
        if "impact" in drop.model.guesses
    ]
    alpha = median(alphas) if alphas else 0.0
    scales, degrees = joint.components, joint.degrees
    if alpha <= 0.0 or degrees.get("departure", 0.0) < ENOUGH:
        return None
    scatter = math.hypot(scales.impulse, scales.impulse_floor / alpha)
    return Likeness(scales.departure, scatter if degrees.get("impulse", 0.0) >= ENOUGH else None)
