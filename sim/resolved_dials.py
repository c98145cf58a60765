"""Dials of the resolved world, ``dynamics=resolved``: its materials, and how chains hang in it.

Where no source is named the default is a guess, chosen so that touches last the 0.1 to 0.3 ms
that hard things of this size take.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from rig.units import Dimension

from .dial import dial, read_values, silent_values
from .resolved.contact_law import DEADEST

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class ResolvedDials:
    """What the model does not know of.

    Attributes
    ----------
    string_restitution
        With what share of its speed a string's jerk throws rods back; a guess. 0.1 is as dead as
        can be, 0.7 lively.
    string_strain
        Relative extension at the 578 N that the paper's line is sold for; makers of braided
        polyethylene state 3 to 5 %, and knots give more.
    board_time, rod_time
        How long a rod's end stays in touch with the board, or with another rod; guesses.
    rod_restitution, rod_friction
        Of rods on rods; guesses, wood being known on the paper's laminate only (0.5 and 0.2).
    rods_touch
        0 lets rods pass through each other, as in the model.
    density
        Of rods that were not weighed, kg/m³: poplar at 12 % moisture, 0.42 to 0.45.
    roll
        0 keeps rods from turning about their own axis, as Eqs. S7 to S10 do.
    tilt_sd, yaw_sd
        Scatter of each rod's tilt, the same in every run, and of its direction in each hanging,
        degrees; guesses.
    aside_sd
        Scatter of each rod's place down the slope in each hanging, m; a guess.
    off_centre_sd
        Scatter of a chain's place along the beams' posts from drop to drop, m; a guess.
    swing_sd
        Speed of the bottom rod down the slope as it is let go, the top rod being at rest, m/s; a
        guess: a swing of 3 mm.
    spin_sd
        Turning of the chain about the vertical, rad/s.
    """

    string_restitution: float = dial(0.3, low=DEADEST, high=1.0, kept=True)
    string_strain: float = dial(0.05, low=1e-4, high=1.0, kept=True)
    board_time: float = dial(0.2e-3, Dimension.TIME, 1e-5, 2e-3, kept=True)
    rod_time: float = dial(0.2e-3, Dimension.TIME, 1e-5, 2e-3, kept=True)
    rod_restitution: float = dial(0.5, low=DEADEST, high=1.0, kept=True)
    rod_friction: float = dial(0.3, high=10.0, kept=True)
    rods_touch: float = dial(1.0, kept=True, switch=True)
    density: float = dial(450.0, Dimension.DENSITY, 1.0, 25e3, kept=True)
    roll: float = dial(1.0, kept=True, switch=True)
    tilt_sd: float = dial(1.0, Dimension.ANGLE, high=45.0)
    yaw_sd: float = dial(2.0, Dimension.ANGLE, high=45.0)
    aside_sd: float = dial(0.5e-3, Dimension.LENGTH, high=0.1)
    off_centre_sd: float = dial(1e-3, Dimension.LENGTH, high=1.0)
    swing_sd: float = dial(10e-3, Dimension.SPEED, high=10.0)
    spin_sd: float = dial(0.0, Dimension.TURNING, high=100.0)


NAMES = tuple(spec.name for spec in fields(ResolvedDials))


def read_resolved_dials(settings: Mapping[str, str], scheme: str = "sim") -> ResolvedDials:
    """Dials from a URL's query; with ``quiet=1`` chains hang perfectly straight and still.

    Parameters
    ----------
    settings
        All that the URL says; what is no dial of this world is passed over.

    Raises
    ------
    InputError
        A value that is not a quantity of its dimension, or out of range.
    """
    quiet = silent_values(ResolvedDials) if settings.get("quiet") == "1" else {}
    return ResolvedDials(**quiet | read_values(ResolvedDials, settings, scheme))
