"""One leg of a fall: uniform acceleration, or that of g − κv² in air, and its derivatives.

The same formulas as in `rig.model.drag`, for arrays, and for κ below zero too: an adjustment tries
what no air does. Where an array takes κ, it may differ by element, its sign never; with such an
array g may differ too.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_NONE = 1e-15  # 1/m: what takes less than an atom's width from a metre
_FAINT = 1e-5  # 1/m: what still is in the last digits of a difference
_SHORT = 0.02  # of y, up to which these terms of (1 − e^(−y))/y will do
_SERIES = [(-1.0) ** n / math.factorial(n + 1) for n in reversed(range(7))]
_NEVER = 1.0 - 1e-9  # tanh of a time: nothing falls longer


def _largest(kappa: float | Array) -> float:
    """The largest κ, with its sign."""
    if isinstance(kappa, float):
        return kappa
    low, high = float(kappa.min(initial=0.0)), float(kappa.max(initial=0.0))
    return high if high > -low else low


def _rate(kappa: float | Array, gravity: float | Array) -> float | Array:
    """√(|κ|g); of one κ a plain number, with which arrays are multiplied quicker."""
    if isinstance(kappa, float) and isinstance(gravity, float):
        return math.sqrt(abs(kappa) * gravity) if gravity > 0.0 else math.nan
    found: Array = np.sqrt(np.abs(kappa) * gravity)
    return found


def fall_for(
    since: Array, speed: Array, gravity: float | Array, kappa: float | Array
) -> tuple[Array, Array]:
    """Way fallen and speed, a time after the beginning of a leg."""
    way, end, _ = _fall(since, speed, gravity, kappa)
    return way, end


def _fall(
    since: Array, speed: Array, gravity: float | Array, kappa: float | Array
) -> tuple[Array, Array, Array]:
    """Way, speed at its end, and the derivative of the way by the speed v at its beginning.

    The way is ln(1 + κw)/κ with w = 2g S(t/2)² + v S(t) and S(t) = sinh(√(κg) t)/√(κg), as in
    `rig.model.drag.fallen`; below κ = 0 with the sine.
    """
    largest = _largest(kappa)
    if abs(largest) < _NONE:
        return (speed + 0.5 * gravity * since) * since, speed + gravity * since, since
    rate = _rate(kappa, gravity)
    # An edge long after the fall overflows no sinh, and meets no second period of the sine.
    sinus, most = (np.sinh, 300.0) if largest > 0.0 else (np.sin, 1.2)
    half = sinus(np.minimum((0.5 * rate) * since, most)) / rate
    square = gravity * half * half
    whole = 2.0 * half * np.sqrt(1.0 + kappa * square)
    # An adjustment may try what no air does: a chain that falls for ever.
    grown = np.maximum(kappa * (2.0 * square + speed * whole), -0.9)
    shrunk = 1.0 / (1.0 + grown)
    end = (gravity * whole + speed * (1.0 + 2.0 * kappa * square)) * shrunk
    return np.log1p(grown) / kappa, end, whole * shrunk


def fall_through(
    distance: Array, speed: Array, gravity: float | Array, kappa: float | Array
) -> tuple[Array, Array]:
    """Speed at the end of a leg and how long it takes, as in `rig.model.drag.drag_leg`."""
    reach = reach_of(distance, kappa)
    # An adjustment may try a rod that strikes above where the one before it did.
    arrival = np.sqrt(np.maximum(_squared(reach, speed, gravity, kappa), 0.0))
    return arrival, lasting(reach, speed, arrival, gravity, kappa)


def lasting(
    reach: Array, speed: Array, arrival: Array, gravity: float | Array, kappa: float | Array
) -> Array:
    """How long a leg takes, by its `reach_of` and the speeds at both ends."""
    tiny = np.finfo(float).tiny
    largest = _largest(kappa)
    if abs(largest) < _NONE:
        return np.asarray(reach / np.maximum(speed + arrival, tiny))
    rate = _rate(kappa, gravity)
    slow = rate * reach / np.maximum(arrival + (1.0 - kappa * reach) * speed, tiny)
    curve = np.arctanh(np.clip(slow, -_NEVER, _NEVER)) if largest > 0.0 else np.arctan(slow)
    return np.asarray(curve / rate)


def _squared(reach: Array, speed: Array, gravity: float | Array, kappa: float | Array) -> Array:
    found: Array = (1.0 - kappa * reach) * speed * speed + gravity * reach
    return found


def reach_of(distance: Array, kappa: float | Array) -> Array:
    """(1 − e^(−2κd))/κ, which is twice the distance d where no air is."""
    if abs(_largest(kappa)) < _NONE:
        return 2.0 * distance
    found: Array = -np.expm1(-2.0 * kappa * distance) / kappa
    return found


def leg_slopes(
    since: Array, speed: Array, gravity: float | Array, kappa: float | Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Way z fallen and speed, a time after the beginning of a leg, and derivatives of z.

    By the speed v at the beginning, by g and by κ. As z(λt; v/λ, g/λ², κ) and z(t; λv, λg, κ/λ)/λ
    are z, the last two follow from the others: 2g ∂z/∂g = t ∂z/∂t − v ∂z/∂v, and
    κ ∂z/∂κ = v ∂z/∂v + g ∂z/∂g − z.
    """
    way, end, by_speed = _fall(since, speed, gravity, kappa)
    by_gravity = (since * end - speed * by_speed) / (2.0 * gravity)
    if abs(_largest(kappa)) < _FAINT:  # else that difference is nothing but rounding
        return way, end, by_speed, by_gravity, -_slowed(since, speed, gravity)
    by_kappa = (speed * by_speed + gravity * by_gravity - way) / kappa
    return way, end, by_speed, by_gravity, by_kappa


def _slowed(since: Array, speed: Array, gravity: float | Array) -> Array:
    """∫∫v² of a ballistic leg, m²."""
    half = 0.5 * speed * speed + (speed * gravity / 3.0 + gravity**2 * since / 12.0) * since
    found: Array = half * since * since
    return found


def reach_slopes(distance: Array, kappa: float | Array) -> tuple[Array, Array]:
    """(1 − e^(−2κd))/κ and its derivative by κ, by their series where these are short."""
    y = 2.0 * kappa * distance
    if np.abs(y).max() < _SHORT:
        share, slope = np.zeros_like(y), np.zeros_like(y)
        for term in _SERIES:  # Horner's rule, of the derivative too
            slope = slope * y + share
            share = share * y + term
        return 2.0 * distance * share, 4.0 * distance**2 * slope
    reach = reach_of(distance, kappa)
    return reach, (2.0 * distance * np.exp(-y) - reach) / kappa
