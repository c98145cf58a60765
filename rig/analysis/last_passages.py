"""V and Δz from the last passages alone: a cross-check without a model of impacts.

Once every rod below has struck, the top rod falls freely. Its last passages, and those of the free
chain about that time, are two short falls of known acceleration. They do not involve α, γ or the
release, so that their errors differ from those of the fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rig.analysis.annealing import matched
from rig.analysis.dual import Dual
from rig.analysis.fit import Fit
from rig.analysis.quantities import AdjustedDrop
from rig.analysis.result import Measured
from rig.analysis.square_root import EquationRows, eliminate
from rig.arrays import Array
from rig.measurands import MEASURANDS, SPEED
from rig.reasons import Reason, make_reason

SEPARATION_RAW = MEASURANDS["separation_raw_m"]
_NEAR = 0.02
"""Largest time of a free chain's passage from the strike, s."""
APART = 3.0
"""Standard uncertainties beyond which two values differ: by chance in 1 of 370."""


class _Passages(NamedTuple):
    """Passages of a chain's top rod, shape ``(edges,)`` each.

    Attributes
    ----------
    times, heights
        Time, s, and nominal height above the gates' zero, m.
    slopes
        Derivatives of the heights by the drop's unknowns, in units of their prior uncertainties;
        shape ``(edges, unknowns)``.
    sigma
        Independent scatter of each edge, m.
    """

    times: Array
    heights: Array
    slopes: Array
    sigma: Array


def last_passages(fit: Fit) -> dict[str, Measured]:
    """Return V and the raw Δz at the contact level from the last passages.

    Returns
    -------
    dict
        Values by JSON name; empty for fewer than two last edges of the top rod, and without Δz if
        no free chain passes a gate at that time.
    """
    model = fit.model
    if "impact" not in model.records or model.records["impact"].chain.chain.rods < 2:
        return {}
    last = _passages(fit, "impact")
    if last.times.size < 2:
        return {}
    when = float(last.times[np.argmin(last.heights)])
    for _ in range(3):  # Newton's method for the time at the contact level
        (height, speed), covariance = _fall(fit, "impact", last, when)
        when += height / speed
    values = {SPEED.name: Measured(speed, _u(covariance, 0.0, 1.0))}
    moment_u = _u(covariance, 1.0, 0.0) / speed
    if "free" in model.records:
        near = _passages(fit, "free", when)
        if near.times.size >= 2 and np.ptp(near.times) > 0.0:
            (height, falling), covariance = _fall(fit, "free", near, when)
            u = math.hypot(_u(covariance, 1.0, 0.0), falling * moment_u)
            values[SEPARATION_RAW.name] = Measured(height, u)
    return values


def disagreements(fitted: Mapping[str, Measured], direct: Mapping[str, Measured]) -> list[Reason]:
    """Return reasons for values of the last passages that differ from those of the fit."""
    reasons = []
    codes = {SPEED: "last_speed_differs", SEPARATION_RAW: "last_separation_differs"}
    for row, code in codes.items():
        whole, alone = fitted.get(row.name), direct.get(row.name)
        # Both share the errors of the last edges, so that this limit is conservative.
        if (
            whole
            and alone
            and abs(whole.value - alone.value) > APART * math.hypot(whole.u, alone.u)
        ):
            unit = row.name.removeprefix(row.stem)
            values = {f"alone{unit}": alone.value, f"whole{unit}": whole.value}
            values |= {"alone_U95": alone.expanded, "whole_U95": whole.expanded}
            reasons.append(make_reason(code, **values))
    return reasons


def _passages(fit: Fit, role: str, when: float | None = None) -> _Passages:
    """Return a side's matched edges near `when`, or of the top rod alone, as its passages."""
    model = fit.model
    expected, nominal = model.expected[role], AdjustedDrop(model, np.zeros(fit.x.size))
    pairing = model.pairings[role]
    pick, edge = matched(fit.matches[role])
    times = pairing.times[edge] * model.rate(fit.x)
    chosen = expected.alone[pick] if when is None else np.abs(times - when) < _NEAR
    pick, times = pick[chosen], times[chosen]
    # At an edge the reference point is at its level; the top rod is higher by the chain's length.
    levels = Dual(expected.levels[pick], model.slopes[role].levels[pick])
    top = nominal.top(role, levels)
    sigma = model.residuals(role, fit.x, fit.matches[role]).sigma[chosen]
    return _Passages(times, top.value, top.slopes * model.unknowns.sd, sigma)


def _fall(fit: Fit, role: str, seen: _Passages, when: float) -> tuple[tuple[float, float], Array]:
    """Return height and speed of a chain's top rod at `when`, and their covariance.

    Least squares of z(t) = z − v(t − t₀) − ½(g − κv²)(t − t₀)²; edges have independent scatter, and
    common errors by the priors of beams and rods.
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
