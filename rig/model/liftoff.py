"""Lift-off of a chain from a level surface: the chain fountain (section S V of the paper)."""

from __future__ import annotations

from rig.errors import DomainError
from rig.model.chain import UNIFORM_ROD_INERTIA
from rig.model.impact import alpha_level


def alpha_liftoff(restitution: float = 0.0, inertia: float = UNIFORM_ROD_INERTIA) -> float:
    """α of the surface's push on a rod that is pulled up by one end, N = αλV², Eq. S20.

    The same as Eq. 8 for a rod that is laid down, with another restitution in it.

    Parameters
    ----------
    restitution
        β' between rod and chain through the string; 0 where the string damps all bouncing.
    inertia
        ξ = 4I/(mL²).
    """
    return alpha_level(restitution, inertia)


def alpha_from_fountain(above_m: float, below_m: float) -> float:
    """α ≈ h_above/(h_above + h_below) from a standing chain fountain (end of section S V).

    Parameters
    ----------
    above_m
        How far the chain rises above its pile.
    below_m
        From the pile down to the floor.

    Raises
    ------
    DomainError
        Unless h_above ≥ 0 and h_below > 0.
    """
    if not above_m >= 0.0 or not below_m > 0.0:
        raise DomainError(
            f"no fountain: {above_m:g} m above and {below_m:g} m below the pile",
            "heights are counted from the pile, both upward and downward as positive",
        )
    return above_m / (above_m + below_m)


def fountain_height(alpha: float, below_m: float) -> float:
    """How far a fountain rises above its pile, the inverse of `alpha_from_fountain`, m.

    Raises
    ------
    DomainError
        Outside 0 ≤ α < 1.
    """
    if not 0.0 <= alpha < 1.0:
        raise DomainError(f"no steady fountain at alpha {alpha:g}: 0 ≤ α < 1 is wanted")
    return below_m * alpha / (1.0 - alpha)
