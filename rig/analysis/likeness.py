"""Does a session's fall look like the model? By what a joint fit had to allow for."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from rig.analysis.joint_fit import JointFit

LIKE_DEPARTURE = 50e-6
"""Least departure that is remarked, m: half of what an edge may be off anyhow."""
ENOUGH = 20.0
"""Degrees of freedom from which on a scatter that was found means something."""
LIKE_IMPULSES = 0.1
"""Scatter of single impulses, relative to α, that is remarked: a tenth of what is explained."""
_SEEN = 0.005  # mm: less than that would be written as nothing


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
        """It in words."""
        size = self.departure * 1e3
        sizes = "once some rods have struck, the others are " + (
            f"off the places that the model has them at by {size:.2f} mm (one standard deviation)"
            if size >= _SEEN
            else "where the model has them, to a hundredth of a millimetre"
        )
        if self.impulses is not None:
            sizes += f", and single impulses scatter by {self.impulses:.0%}"
        if self.like:
            return f"these falls look like the model: {sizes}"
        return (
            f"these falls do not look like the model: {sizes}. Results and their ± allow for that; "
            "what follows from the equations, such as β, μ and γ, rests on what was not seen"
        )

    def json(self) -> dict[str, Any]:
        """``{"like_model", "departure_m", "impulses", "sentence"}``."""
        return {"like_model": self.like, "departure_m": self.departure, "impulses": self.impulses,
                "sentence": self.sentence}  # fmt: skip


def likeness(joint: JointFit) -> Likeness | None:
    """Judge the falls of a session; `None` where none strikes, or too few edges tell."""
    alphas = [
        abs(drop.model.guesses["impact"].alpha)
        for drop in joint.drops
        if "impact" in drop.model.guesses
    ]
    alpha = median(alphas) if alphas else 0.0
    found, told = joint.components, joint.degrees
    if alpha <= 0.0 or told.get("departure", 0.0) < ENOUGH:
        return None
    scatter = math.hypot(found.impulse, found.impulse_floor / alpha)
    return Likeness(found.departure, scatter if told.get("impulse", 0.0) >= ENOUGH else None)
