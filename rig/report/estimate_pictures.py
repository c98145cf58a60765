"""Pictures of what `rig estimate` finds."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rig.measurands import SEPARATION
from rig.report.figure import Chart, Panel, PlotAxis, Trace, residual_panel
from rig.report.looks import INK, MODEL, MUTED, SECOND

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from rig.estimate.alphas import SingleAlphas
    from rig.estimate.curves import Curve, DropCurves
    from rig.estimate.rods import Impulses
    from rig.estimate.session import Coefficients, SessionEstimate
    from rig.report.figure import Role
    from rig.sections import Sections

    Array = NDArray[np.float64]

T = TypeVar("T")

_SHOWN = 3
_STYLES: tuple[tuple[Role, int], ...] = (("ring", MODEL), ("square", SECOND), ("mean", INK))


def estimate_pictures(
    found: SessionEstimate, sections: Sections, *, simulated: bool
) -> dict[str, Chart]:
    """Draw everything there is, by file name without its ending.

    Parameters
    ----------
    found
        From ``rig estimate``.
    sections
        Where a picture that cannot be drawn is noted.
    simulated
        Whether to stamp them so.
    """
    wanted: dict[str, tuple[str, Callable[[], Chart | None]]] = {}
    if found.alphas is not None:
        wanted["alpha"] = "The picture of α", partial(_alpha, found.alphas, simulated)
    if found.impulses:
        wanted["impulses"] = (
            "The picture of the impulses",
            partial(_impulses, found.impulses, simulated),
        )
    if found.curves:
        what = "The picture of Δz(t) and V²(z)" if found.free_chain else "The picture of V²(z)"
        wanted["curves"] = what, partial(_curves, found.curves, simulated)
    coefficients = found.coefficients
    names = {one.name for one in coefficients.parameters} if coefficients else set()
    if coefficients is not None and {"restitution", "friction"} <= names:
        wanted["posterior"] = (
            "The picture of the posterior",
            partial(_posterior, coefficients, simulated),
        )
    drawn = {name: sections.make(what, draw) for name, (what, draw) in wanted.items()}
    return {name: figure for name, figure in drawn.items() if figure is not None}


def _alpha(found: SingleAlphas, simulated: bool) -> Chart:
    """α against incline, and below it every run's residual."""
    axis = PlotAxis("incline of the surface (°)")
    fitted = [line for line in found.inclines if line.model is not None]
    left = [(run.run.incline_deg, run.residual) for run in found.runs if run.residual is not None]
    series = [
        Trace("single runs", [run.run.incline_deg for run in found.runs],
               [run.alpha.value for run in found.runs], "points", MUTED),
        Trace("by fitted coefficients", [line.condition.incline_deg for line in fitted],
               [float(line.model or 0.0) for line in fitted], "dash", MODEL),
        Trace("incline ± U", [line.condition.incline_deg for line in found.inclines],
               [line.alpha.value for line in found.inclines], "mean", INK,
               [line.alpha.expanded for line in found.inclines]),
    ]  # fmt: skip
    panels = [Panel(axis, PlotAxis("α"), series)]
    if left:
        places, residuals = zip(*left, strict=True)
        panels.append(residual_panel(axis, places, [value / 2.0 for value in residuals]))
    words = (
        "The best single α of every incline and run. Below: each run less the fit, in units of U."
    )
    return Chart("Impact coefficient against incline, with residuals", words, panels, simulated)


def _impulses(found: Sequence[Impulses], simulated: bool) -> Chart:
    """ΔV of every rod beside Eq. 9, and the normalized errors of all inclines."""
    axis = PlotAxis("rod, counted from the bottom")
    series = []
    for line, (role, color) in zip(_spread(found), _STYLES, strict=False):
        rods = [1 + (gain.first + gain.last) / 2 for gain in line.gains]
        words = f"{line.condition.incline_deg:g}°"
        series += [
            Trace("", rods, [gain.eq9_m_s for gain in line.gains], "line", color),
            Trace(words, rods, [gain.measured.value for gain in line.gains], role, color,
                   [gain.measured.expanded for gain in line.gains]),
        ]  # fmt: skip
    errors = [
        (1 + (gain.first + gain.last) / 2, float(gain.normalized_error))
        for line in found
        for gain in line.gains
        if gain.normalized_error is not None
    ]
    panels = [Panel(axis, PlotAxis("speed gained ΔV (m/s)"), series, 140.0)]
    panels += [residual_panel(axis, *zip(*errors, strict=True))] if errors else []
    words = (
        "Speed that the chain gains as each rod strikes: measured ± U, and by Eq. 9 with the best "
        "α of the incline (lines). Below: the normalized errors of all inclines."
    )
    return Chart("Speed gained from each rod's impact", words, panels, simulated)


def _curves(found: Sequence[DropCurves], simulated: bool) -> Chart:
    """Δz(t) and V²(z) with bands (Fig. 4)."""
    shown = list(zip(_spread(found), (color for _, color in _STYLES), strict=False))
    free = all(drop.separation is not None for drop, _ in shown)
    panels = []
    if free:
        series = [
            one
            for drop, color in shown
            if drop.separation is not None
            for one in _banded(drop, drop.time_s, drop.separation, SEPARATION.scale, color)
        ]
        time, height = PlotAxis("time since release (s)"), PlotAxis("separation Δz (cm)")
        panels.append(Panel(time, height, series, 140.0))
    series = [
        one
        for drop, color in shown
        for one in _banded(drop, drop.height_m, drop.squared_speed, 1.0, color)
    ]
    panels.append(
        Panel(PlotAxis("height of the top rod z (m)"), PlotAxis("V² (m²/s²)"), series, 140.0)
    )
    return Chart(
        "Separation against time and squared speed against height"
        if free
        else "Squared speed against height",
        f"Single drops: {'Δz(t) at simultaneous release and V²(z)' if free else 'V²(z)'}, with "
        "95 % bands. Dashed: the model with the protocol's coefficients.",
        panels,
        simulated,
    )


def _banded(drop: DropCurves, at: Array, curve: Curve, scale: float, color: int) -> Iterator[Trace]:
    places, values = at.tolist(), (scale * curve.measured).tolist()
    words = f"{drop.run.incline_deg:g}°, run {drop.run.number}"
    yield Trace("", places, values, "band", color, (scale * curve.u95).tolist())
    yield Trace(words, places, values, "line", color)
    yield Trace("", places, (scale * curve.model).tolist(), "dash", color)


def _posterior(coefficients: Coefficients, simulated: bool) -> Chart | None:
    """Draw the regions of β and μ that hold 68.3 % and 95 %; `None` where they have no spread."""
    mixture = coefficients.posterior
    assert mixture is not None
    beta, mu = (mixture.names.index(name) for name in ("restitution", "friction"))
    weights, means, sds = mixture.weights, mixture.means, mixture.sds
    middle = float(weights @ means[:, beta])
    spread = float(np.sqrt(weights @ (sds[:, beta] ** 2 + (means[:, beta] - middle) ** 2)))
    # Smooth from node to node: more of them for the eye.
    kept = weights > 1e-6 * weights.max()
    if np.ptp(means[kept, mu]) <= 0.0 or spread <= 0.0:
        return None
    nodes = np.linspace(means[kept, mu].min(), means[kept, mu].max(), 161)
    logs, centre, width = (
        np.interp(nodes, means[kept, mu], values[kept])
        for values in (
            np.log(np.maximum(weights, np.finfo(float).tiny)),
            means[:, beta],
            sds[:, beta],
        )
    )
    grid = np.linspace(middle - 4.5 * spread, middle + 4.5 * spread, 121)
    density = np.exp(logs - 0.5 * ((grid[:, None] - centre) / width) ** 2) / width
    # The least density inside the smallest regions that hold these shares.
    ordered = np.sort(density, axis=None)[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    series = []
    for share, words in ((0.95, "95 %"), (0.683, "68.3 %")):
        level = ordered[np.searchsorted(held, share)]
        # At each μ the densities of β have one summit: a region is a band.
        inside = [np.flatnonzero(column >= level) for column in density.T]
        rows = [(x, grid[at[[0, -1]]]) for x, at in zip(nodes, inside, strict=True) if at.size]
        if len(rows) < 2:
            return None  # narrower than the grid
        centres = [float(ends.mean()) for _, ends in rows]
        halves = [float(np.ptp(ends)) / 2 for _, ends in rows]
        series.append(Trace(words, [float(mu_) for mu_, _ in rows], centres, "band", MODEL, halves))
    best = {one.name: one.least_squares.value for one in coefficients.parameters}
    series.append(Trace("least squares", [best["friction"]], [best["restitution"]], "cross", INK))
    words = "Posterior of β and μ: the smallest regions that contain 68.3 % and 95 %."
    panel = Panel(PlotAxis("friction μ"), PlotAxis("restitution β"), series, 150.0)
    return Chart("Posterior of restitution and friction", words, [panel], simulated)


def _spread(lines: Sequence[T]) -> list[T]:
    """Pick at most three, the outermost and one between."""
    if len(lines) <= _SHOWN:
        return list(lines)
    return [lines[n] for n in (len(lines) // 3, len(lines) * 2 // 3, len(lines) - 1)]
