"""Dials of the resolved world, ``dynamics=resolved``: its materials, and how chains hang in it.

Where no source is named the default is a guess, chosen so that touches last the 0.1 to 0.3 ms
that hard things of this size take.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

from rig.errors import InputError
from rig.units import Dimension, UnitError, parse

from .resolved.contact_law import DEADEST

if TYPE_CHECKING:
    from collections.abc import Mapping


def _dial(default: float, dimension: Dimension, low: float, high: float) -> Any:
    return field(default=default, metadata={"dimension": dimension, "low": low, "high": high})


def _switch() -> Any:
    return field(
        default=1.0,
        metadata={"dimension": Dimension.NUMBER, "low": 0.0, "high": 1.0, "switch": True},
    )


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

    string_restitution: float = _dial(0.3, Dimension.NUMBER, DEADEST, 1.0)
    string_strain: float = _dial(0.05, Dimension.NUMBER, 1e-4, 1.0)
    board_time: float = _dial(0.2e-3, Dimension.TIME, 1e-5, 2e-3)
    rod_time: float = _dial(0.2e-3, Dimension.TIME, 1e-5, 2e-3)
    rod_restitution: float = _dial(0.5, Dimension.NUMBER, DEADEST, 1.0)
    rod_friction: float = _dial(0.3, Dimension.NUMBER, 0.0, 10.0)
    rods_touch: float = _switch()
    density: float = _dial(450.0, Dimension.DENSITY, 1.0, 25e3)
    roll: float = _switch()
    tilt_sd: float = _dial(1.0, Dimension.ANGLE, 0.0, 45.0)
    yaw_sd: float = _dial(2.0, Dimension.ANGLE, 0.0, 45.0)
    aside_sd: float = _dial(0.5e-3, Dimension.LENGTH, 0.0, 0.1)
    off_centre_sd: float = _dial(1e-3, Dimension.LENGTH, 0.0, 1.0)
    swing_sd: float = _dial(10e-3, Dimension.SPEED, 0.0, 10.0)
    spin_sd: float = _dial(0.0, Dimension.TURNING, 0.0, 100.0)


NAMES = tuple(one.name for one in fields(ResolvedDials))
_UNITS = {
    Dimension.TIME: " s", Dimension.LENGTH: " m", Dimension.ANGLE: " deg", Dimension.SPEED: " m/s",
    Dimension.DENSITY: " kg/m^3", Dimension.TURNING: " rad/s",
}  # fmt: skip
"""Of what `parse` gives, as limits are told in."""
_HANGING = ("tilt_sd", "yaw_sd", "aside_sd", "off_centre_sd", "swing_sd", "spin_sd")


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
    quiet = dict.fromkeys(_HANGING, 0.0) if settings.get("quiet") == "1" else {}
    changes = dict(quiet)
    for one in fields(ResolvedDials):
        if one.name not in settings:
            continue
        text, kind = settings[one.name], one.metadata
        try:
            value = parse(text, kind["dimension"]).value
        except UnitError as error:
            raise InputError(f"{scheme}://: {one.name}: {error}") from None
        if kind.get("switch") and value not in {0.0, 1.0}:
            raise InputError(f"{scheme}://: {one.name}: {text} is neither 0 nor 1")
        unit = _UNITS.get(kind["dimension"], "")
        if not kind["low"] <= value <= kind["high"]:
            raise InputError(
                f"{scheme}://: {one.name}: {text} is outside of what is accepted",
                f"{kind['low']:g} to {kind['high']:g}{unit}",
            )
        changes[one.name] = value
    return replace(ResolvedDials(), **changes)
