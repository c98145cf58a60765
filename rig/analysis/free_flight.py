"""Legs of a fall with the acceleration g − κv², and their derivatives, for arrays of legs.

The formulas are those of `rig.model.drag`, extended to κ < 0, which a trial step of a fit may
reach. κ may differ from leg to leg but not in sign, and is never 0: see `some_air`.
"""

import numpy as np

from rig.arrays import Array

NONE = 1e-15
"""κ used in place of 0, 1/m: its effect over a metre is below an atom's width."""
FAINT = 1e-5
"""κ below which series in κ replace differences divided by κ, 1/m; exact to 1e-10."""


def some_air(kappa: float | Array) -> Array:
    """Return κ with zeros replaced by `NONE`."""
    return np.asarray(kappa + NONE * (np.abs(kappa) < NONE), dtype=np.float64)


def _rate(gravity: float | Array, kappa: float | Array) -> float | Array:
    """Return √(|κ|g), 1/s; NaN for g < 0."""
    rate: float | Array = np.sqrt(np.abs(kappa) * gravity)
    return rate


def fall_for(
    since: Array, speed: Array, gravity: float | Array, kappa: float | Array
) -> tuple[Array, Array, Array]:
    """Return distance z and speed at a time t after the start of a leg at speed v, and ∂z/∂v.

    z is ln(1 + κw)/κ with w = 2g S(t/2)² + v S(t) and S(t) = sinh(√(κg) t)/√(κg), as in
    `rig.model.drag.fallen`; below κ = 0 with the sine.
    """
    rate = _rate(gravity, kappa)
    # Clip for edges long after the fall: sinh must not overflow, nor the sine repeat.
    sinus, largest = (np.sinh, 300.0) if np.all(kappa > 0.0) else (np.sin, 1.2)
    half = sinus(np.minimum((0.5 * rate) * since, largest)) / rate
    square = gravity * half * half
    sine = 2.0 * half * np.sqrt(1.0 + kappa * square)
    # Clip for trial steps with κ < 0, where a chain reaches infinite speed.
    grown = np.maximum(kappa * (2.0 * square + speed * sine), -0.9)
    shrunk = 1.0 / (1.0 + grown)
    end = (gravity * sine + speed * (1.0 + 2.0 * kappa * square)) * shrunk
    return np.log1p(grown) / kappa, end, sine * shrunk


def fall_slopes(
    since: Array,
    speed: Array,
    fall: tuple[Array, Array, Array],
    gravity: float | Array,
    kappa: float | Array,
) -> tuple[Array, Array]:
    """Return the derivatives by g and by κ of the distance z that `fall_for` returns.

    As z(λt; v/λ, g/λ², κ) and z(t; λv, λg, κ/λ)/λ equal z, they follow from the others:
    2g ∂z/∂g = t ∂z/∂t − v ∂z/∂v, and κ ∂z/∂κ = v ∂z/∂v + g ∂z/∂g − z.
    """
    fallen, end, by_speed = fall
    slower = speed * by_speed
    by_gravity = (since * end - slower) / (2.0 * gravity)
    if np.all(np.abs(kappa) < FAINT):  # −∫∫v² of a ballistic leg
        half = 0.5 * speed * speed + (speed * gravity / 3.0 + gravity**2 * since / 12.0) * since
        return by_gravity, -half * since * since
    return by_gravity, (slower + gravity * by_gravity - fallen) / kappa


def reach_of(distance: Array, kappa: float | Array) -> Array:
    """Return (1 − e^(−2κd))/κ, which is twice the distance d without drag."""
    return np.asarray(-np.expm1(-2.0 * kappa * distance) / kappa)


def reach_slopes(distance: Array, reach: Array, kappa: float | Array) -> Array:
    """Return the derivative of `reach_of` by κ."""
    y = 2.0 * kappa * distance
    if np.all(np.abs(kappa) < FAINT):
        return np.asarray(-4.0 * distance**2 * (0.5 - y / 3.0 + y * y / 8.0))
    return np.asarray((2.0 * distance * np.exp(-y) - reach) / kappa)


def speed_slope(
    since: Array, distance: Array, gravity: float | Array, kappa: float | Array
) -> Array:
    """Return ∂z/∂v of a leg of duration t and distance z: S(t) e^(−κz), see `fall_for`."""
    rate = _rate(gravity, kappa)
    sinus = np.sinh if np.all(kappa > 0.0) else np.sin
    return np.asarray(sinus(rate * since) / rate * np.exp(-kappa * distance))


def lasting(
    reach: Array, speed: Array, arrival: Array, gravity: float | Array, kappa: float | Array
) -> Array:
    """Return the duration of a leg, s, from its `reach_of` and the speeds at both ends."""
    rate = _rate(gravity, kappa)
    begin = arrival + (1.0 - kappa * reach) * speed
    slow = rate * reach / np.maximum(begin, np.finfo(float).tiny)
    if not np.all(kappa > 0.0):
        return np.asarray(np.arctan(slow) / rate)
    never = 1.0 - np.finfo(float).eps  # arctanh must stay finite
    return np.asarray(np.arctanh(np.clip(slow, -never, never)) / rate)
