"""V and Δz from the last passages alone: a second opinion that knows no impacts.

Once every rod below has struck, the top rod falls freely. Its last passages, and those of the free
chain about that time, are two short falls of known acceleration: with no α, no γ and no release in
them, they are wrong in other ways than the adjustment of a whole drop.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.dual import Dual
from rig.analysis.quantities import Adjusted
from rig.analysis.result import Measured
from rig.analysis.square_root import EquationRows, eliminate
from rig.measurands import MEASURANDS
from rig.reasons import Reason, make_reason

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.analysis.fit import Fit
    from rig.arrays import Array


_NEAR = 0.02
"""How far from the moment that is asked for a passage of the free chain may be, s."""
APART = 3.0
"""Standard uncertainties beyond which two values are not the same: normal ones are in 1 of 370."""


class _Passages(NamedTuple):
    """When a chain's top rod was where, shape ``(edges,)`` each.

    Attributes
    ----------
    times, heights
        s, m above the gates' zero; as nominal, whatever the rod and the beam were off.
    slopes
        Derivatives of the heights by the drop's unknowns, in units of their prior uncertainties;
        shape ``(edges, unknowns)``.
    sigma
        What each edge is off by itself, m.
    """

    times: Array
    heights: Array
    slopes: Array
    sigma: Array


def last_passages(fit: Fit) -> dict[str, Measured]:
    """Measure V, and Δz as it fell, at the contact level.

    Returns
    -------
    dict
        By JSON name; nothing where the top rod's last passages are fewer than two edges, and no Δz
        where the free chain is not seen at that time.
    """
    model = fit.model
    if "impact" not in model.records or model.records["impact"].chain.chain.rods < 2:
        return {}
    last = _passages(fit, "impact")
    if last.times.size < 2:
        return {}
    when = float(last.times[np.argmin(last.heights)])
    for _ in range(3):  # Newton's steps to the moment at which it is at the contact level
        (height, speed), covariance = _fall(fit, "impact", last, when)
        when += height / speed
    values = {"speed_m_s": Measured(speed, _u(covariance, 0.0, 1.0))}
    moment_u = _u(covariance, 1.0, 0.0) / speed
    if "free" in model.records:
        near = _passages(fit, "free", when)
        if near.times.size >= 2 and np.ptp(near.times) > 0.0:
            (height, falling), covariance = _fall(fit, "free", near, when)
            u = math.hypot(_u(covariance, 1.0, 0.0), falling * moment_u)
            values["separation_raw_m"] = Measured(height, u)
    return values


def disagreements(fitted: Mapping[str, Measured], direct: Mapping[str, Measured]) -> list[Reason]:
    """Say what the last passages alone have otherwise than the adjustment of the whole drop."""
    reasons = []
    codes = {"speed_m_s": "last_speed_differs", "separation_raw_m": "last_separation_differs"}
    for name, code in codes.items():
        if name not in fitted or name not in direct:
            continue
        adjusted, last = fitted[name], direct[name]
        # They share their last edges and so the errors of these: they are nearer than that.
        if abs(adjusted.value - last.value) > APART * math.hypot(adjusted.u, last.u):
            unit = name.removeprefix(MEASURANDS[name].stem)
            values = {f"alone{unit}": last.value, f"whole{unit}": adjusted.value}
            values |= {"alone_U95": last.expanded, "whole_U95": adjusted.expanded}
            reasons.append(make_reason(code, **values))
    return reasons


def _passages(fit: Fit, role: str, when: float | None = None) -> _Passages:
    """Collect a side's matched edges about some time, or at last, as passages of its top rod."""
    model = fit.model
    expected, nominal = model.expected[role], Adjusted(model, np.zeros(fit.x.size))
    pairing = model.pairings[role]
    pick, edge = pairing.observed(fit.matches[role])
    times = pairing.times[edge] * model.rate(fit.x)
    chosen = expected.alone[pick] if when is None else np.abs(times - when) < _NEAR
    pick, times = pick[chosen], times[chosen]
    # The reference is at the level when the edge comes, and the top rod as much higher.
    levels = Dual(expected.levels[pick], model.slopes[role].levels[pick])
    top = nominal.top(role, levels)
    sigma = model.residuals(role, fit.x, fit.matches[role]).sigma[chosen]
    return _Passages(times, top.value, top.slopes * model.unknowns.sd, sigma)


def _fall(fit: Fit, role: str, seen: _Passages, when: float) -> tuple[tuple[float, float], Array]:
    """Height and speed of a chain's top rod at a moment, and their covariance.

    Least squares of z(t) = z − v(t − t₀) − ½(g − κv²)(t − t₀)²: edges are off by themselves, and
    together by all that the table of unknowns has of beams and rods.
    """
    since = seen.times - when
    path = fit.model.trajectory(role, fit.x)
    (speed,), kappa = path.heights(np.array([when]))[1], np.ravel(path.kappas(np.array([-1])))[0]
    fallen = seen.heights + 0.5 * (fit.model.protocol.gravity.value - kappa * speed**2) * since**2
    off = seen.slopes[:, seen.slopes.any(axis=0)]
    own, both = np.split(np.arange(off.shape[1] + 2), [off.shape[1]])
    rows = np.column_stack([-off, np.ones_like(since), -since]) / seen.sigma[:, None]
    equations = EquationRows(rows, -fallen / seen.sigma, np.append(own, both))
    ones = np.ones(rows.shape[1])
    rest = eliminate([equations], ones, np.zeros_like(ones), own, both).rest
    inverse = np.linalg.inv(rest.slopes[:2])
    height, speed = -inverse @ rest.left[:2]
    return (float(height), float(speed)), np.asarray(inverse @ inverse.T, dtype=np.float64)


def _u(covariance: Array, *slope: float) -> float:
    return math.sqrt(float(np.array(slope) @ covariance @ np.array(slope)))
