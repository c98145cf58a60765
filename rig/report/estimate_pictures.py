"""Pictures of what `rig estimate` finds."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rig.measurands import SEPARATION
from rig.report.figure import Panel, PlotAxis, Trace, chart, measured, residual_panels, series
from rig.report.looks import INK, MODEL, MUTED, SECOND

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from rig.estimate.curves import Curve, DropCurves
    from rig.estimate.posterior import Posterior
    from rig.estimate.session import SessionEstimate
    from rig.report.figure import Chart, Role
    from rig.sections import Sections

    Array = NDArray[np.float64]

T = TypeVar("T")

_SHOWN = 3
_STYLES: tuple[tuple[Role, int], ...] = (("ring", MODEL), ("square", SECOND), ("mean", INK))
_SHARES = (0.683, 0.95)
_FEWEST = 4  # points of the grid in the larger region


def estimate_pictures(found: SessionEstimate, sections: Sections) -> dict[str, Chart]:
    """Draw everything there is, by file name without its ending.

    Parameters
    ----------
    found
        From ``rig estimate``.
    sections
        Where a picture that cannot be drawn is noted.
    """
    pictures = {"alpha": _alpha, "impulses": _impulses, "curves": _curves, "posterior": _posterior}
    drawn = {
        name: sections.make(f"The picture of the {name}", partial(draw, found))
        for name, draw in pictures.items()
    }
    return {name: figure for name, figure in drawn.items() if figure is not None}


def _alpha(found: SessionEstimate) -> Chart | None:
    """α against incline, and below it every run's residual."""
    if found.alphas is None:
        return None
    axis, alphas = PlotAxis("incline of the surface (°)"), found.alphas
    fitted = [line for line in alphas.inclines if line.model is not None]
    inclines = ((line.condition.incline_deg, line.alpha) for line in alphas.inclines)
    residuals = (
        (run.run.incline_deg, run.residual / 2.0) for run in alphas.runs if run.residual is not None
    )
    traces = [
        measured(
            "single runs",
            ((run.run.incline_deg, run.alpha) for run in alphas.runs),
            "points",
            MUTED,
        ),
        series(
            "by fitted coefficients",
            [line.condition.incline_deg for line in fitted],
            [line.model or 0.0 for line in fitted],
            "dash",
            MODEL,
        ),
        measured("incline ± U", inclines, "mean"),
    ]
    return chart("alpha", [Panel(axis, PlotAxis("α"), traces), *residual_panels(axis, residuals)])


def _impulses(found: SessionEstimate) -> Chart | None:
    """ΔV of every rod beside Eq. 9, and the normalized errors of all inclines."""
    if not found.impulses:
        return None
    axis, traces = PlotAxis("rod, counted from the bottom"), []
    for line, (role, color) in zip(_spread(found.impulses), _STYLES, strict=False):
        gains = [(1 + (gain.first + gain.last) / 2, gain) for gain in line.gains]
        rods, values = [rod for rod, _ in gains], [gain.eq9_m_s for _, gain in gains]
        speeds = ((rod, gain.measured) for rod, gain in gains)
        traces += [
            series("", rods, values, "line", color),
            measured(f"{line.condition.incline_deg:g}°", speeds, role, color),
        ]
    errors = [
        (1 + (gain.first + gain.last) / 2, gain.normalized_error)
        for line in found.impulses
        for gain in line.gains
        if gain.normalized_error is not None
    ]
    panel = Panel(axis, PlotAxis("speed gained ΔV (m/s)"), traces, 140.0)
    return chart("impulses", [panel, *residual_panels(axis, errors)])


def _curves(found: SessionEstimate) -> Chart | None:
    """Δz(t) and V²(z) with bands (Fig. 4)."""
    shown = list(zip(_spread(found.curves or ()), (color for _, color in _STYLES), strict=False))
    if not shown:
        return None
    falls = [
        trace
        for drop, color in shown
        if drop.separation is not None
        for trace in _banded(drop, drop.time_s, drop.separation, color, SEPARATION.scale)
    ]
    squares = [
        trace
        for drop, color in shown
        for trace in _banded(drop, drop.height_m, drop.squared_speed, color)
    ]
    time, height = PlotAxis("time since release (s)"), PlotAxis("height of the top rod z (m)")
    panels = [Panel(height, PlotAxis("V² (m²/s²)"), squares, 140.0)]
    title, words = "Squared speed against height", "V²(z)"
    if falls:
        panels.insert(0, Panel(time, PlotAxis(SEPARATION.axis), falls, 140.0))
        title = "Separation against time and squared speed against height"
        words = "Δz(t) at simultaneous release and V²(z)"
    return chart("curves", panels, title=title, words=words)


def _banded(
    drop: DropCurves, at: Array, curve: Curve, color: int, scale: float = 1.0
) -> Iterator[Trace]:
    words = f"{drop.run.incline_deg:g}°, run {drop.run.number}"
    yield series("", at, curve.measured, "band", color, curve.u95, scale)
    yield series(words, at, curve.measured, "line", color, scale=scale)
    yield series("", at, curve.model, "dash", color, scale=scale)


def _posterior(found: SessionEstimate) -> Chart | None:
    """Draw the regions of β and μ that hold 68.3 % and 95 %; `None` where they have no spread."""
    parameters = found.coefficients.parameters if found.coefficients else ()
    best = {one.name: one.least_squares.value for one in parameters}
    if found.coefficients is None or not {"restitution", "friction"} <= best.keys():
        return None
    assert found.coefficients.posterior is not None
    regions = _regions(found.coefficients.posterior)
    if regions is None:
        return None
    point = series("least squares", [best["friction"]], [best["restitution"]], "cross")
    panel = Panel(PlotAxis("friction μ"), PlotAxis("restitution β"), [regions, point], 150.0)
    return chart("posterior", [panel])


def _regions(mixture: Posterior) -> Trace | None:
    """Return what share the smallest region holds on whose edge a point lies, with two levels."""
    beta, mu = (mixture.names.index(name) for name in ("restitution", "friction"))
    kept = mixture.weights > 1e-6 * mixture.weights.max()
    weights, means, sds = mixture.weights[kept], mixture.means[kept], mixture.sds[kept, beta]
    middle = float(np.average(means[:, beta], weights=weights))
    spread = np.sqrt(np.average(sds**2 + (means[:, beta] - middle) ** 2, weights=weights))
    if np.ptp(means[:, mu]) <= 0.0 or spread <= 0.0:
        return None
    # Smooth from node to node: more of them for the eye.
    nodes = np.linspace(means[:, mu].min(), means[:, mu].max(), 161)
    logs, centre, width = (
        np.interp(nodes, means[:, mu], values) for values in (np.log(weights), means[:, beta], sds)
    )
    grid = np.linspace(middle - 4.5 * spread, middle + 4.5 * spread, 121)
    density = np.exp(logs - 0.5 * ((grid[:, None] - centre) / width) ** 2) / width
    densest = np.argsort(density, axis=None)[::-1]
    held = np.empty(density.size)
    held[densest] = np.cumsum(density.ravel()[densest]) / density.sum()
    if not _FEWEST < np.sum(held < _SHARES[1]) < held.size:
        return None  # narrower than the grid
    return Trace("", nodes.tolist(), grid.tolist(), "levels", MODEL, _SHARES, z=held.tolist())


def _spread(lines: Sequence[T]) -> list[T]:
    """Pick at most three, the outermost and one between."""
    if len(lines) <= _SHOWN:
        return list(lines)
    return [lines[n] for n in (len(lines) // 3, len(lines) * 2 // 3, len(lines) - 1)]
