"""Pictures of what `rig estimate` finds."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rig.measurands import SEPARATION
from rig.report.canvas import INK, MODEL, MODEL_BAND, MUTED, PAPER, SECOND, canvas
from rig.report.embed import PageFigure

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from rig.estimate.alphas import SingleAlphas
    from rig.estimate.curves import Curve, DropCurves
    from rig.estimate.rods import Impulses
    from rig.estimate.session import Coefficients, SessionEstimate
    from rig.sections import Sections

    Array = NDArray[np.float64]

T = TypeVar("T")

_SHOWN = 3
_STYLES = (("o", MODEL), ("s", SECOND), ("^", INK))


def estimate_pictures(
    found: SessionEstimate, sections: Sections, *, simulated: bool
) -> dict[str, PageFigure]:
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
    wanted: dict[str, tuple[str, Callable[[], PageFigure | None]]] = {}
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
    told = found.coefficients
    if told is not None and {"restitution", "friction"} <= {one.name for one in told.parameters}:
        wanted["posterior"] = "The picture of the posterior", partial(_posterior, told, simulated)
    drawn = {name: sections.make(what, draw) for name, (what, draw) in wanted.items()}
    return {name: picture for name, picture in drawn.items() if picture is not None}


def _alpha(found: SingleAlphas, simulated: bool) -> PageFigure:
    """α against incline, and below it every run's residual."""
    left = [(run.run.incline_deg, run.residual) for run in found.runs if run.residual is not None]
    with canvas((2.6, 1.6) if left else (2.6,), simulated=simulated) as drawing:
        top = drawing.axes[0]
        top.plot(
            [one.run.incline_deg for one in found.runs],
            [one.alpha.value for one in found.runs],
            "o", color=MUTED, markersize=3, alpha=0.5, markeredgewidth=0, label="single runs",
        )  # fmt: skip
        fitted = [one for one in found.inclines if one.model is not None]
        top.plot(
            [one.condition.incline_deg for one in fitted],
            np.array([one.model for one in fitted], float),
            "_", color=MODEL, markersize=16, label="fitted coefficients",
        )  # fmt: skip
        top.errorbar(
            [one.condition.incline_deg for one in found.inclines],
            [one.alpha.value for one in found.inclines],
            yerr=[one.alpha.expanded for one in found.inclines],
            fmt="o", color=INK, markersize=4, label="incline ± U (95 %)",
        )  # fmt: skip
        top.set_ylabel("α")
        top.legend()
        if left:
            low = drawing.axes[1]
            low.axhspan(-2, 2, color=MODEL_BAND, alpha=0.6, linewidth=0)
            low.plot(*zip(*left, strict=True), "o", color=MODEL, markersize=3, markeredgewidth=0)
            low.set_ylabel("residual / u")
        drawing.axes[-1].set_xlabel("incline of the surface (°)")
    return PageFigure(
        drawing.svg,
        "Impact coefficient against incline, with residuals",
        "The best single α of every incline and run. Below: each run minus the fit, in standard "
        "uncertainties (band: ±2).",
        "impacts",
    )


def _impulses(found: Sequence[Impulses], simulated: bool) -> PageFigure:
    """ΔV of every rod beside Eq. 9, and the normalized errors of all inclines."""
    shown = _spread(found)
    with canvas((2.6, 1.6), simulated=simulated) as drawing:
        top, low = drawing.axes
        for one, (marker, color) in zip(shown, _STYLES, strict=False):
            rods = [1 + (gain.first + gain.last) / 2 for gain in one.gains]
            top.plot(rods, [gain.eq9_m_s for gain in one.gains], "-", color=color, linewidth=1)
            top.errorbar(
                rods,
                [gain.measured.value for gain in one.gains],
                yerr=[gain.measured.expanded for gain in one.gains],
                fmt=marker, color=color, markerfacecolor=PAPER, markersize=4,
                label=f"{one.condition.incline_deg:g}° ± U (95 %)",
            )  # fmt: skip
        gains = [
            value
            for one in shown
            for gain in one.gains
            for value in (gain.eq9_m_s, gain.measured.value)
        ]
        if max(gains, default=0.0) > 0.0:  # α may be nothing, and noise less
            top.set_yscale("log")
        top.set_ylabel("speed gained ΔV (m/s)")
        top.legend(title="lines: Eq. 9")
        low.axhspan(-1, 1, color=MODEL_BAND, alpha=0.6, linewidth=0)
        for one in found:
            low.plot(
                [1 + (gain.first + gain.last) / 2 for gain in one.gains],
                np.array([gain.normalized_error for gain in one.gains], float),
                "o", color=MODEL, markersize=3, alpha=0.6, markeredgewidth=0,
            )  # fmt: skip
        low.set_ylabel("Eₙ, all inclines")
        low.set_xlabel("rod, counted from the bottom")
    return PageFigure(
        drawing.svg,
        "Speed gained from each rod's impact",
        "Speed that the chain gains as each rod strikes: measured, and by Eq. 9 with the best α of "
        "the incline. Below: the normalized errors.",
        "impacts",
    )


def _curves(found: Sequence[DropCurves], simulated: bool) -> PageFigure:
    """Δz(t) and V²(z) with bands (Fig. 4)."""
    shown = _spread(found)
    row = SEPARATION
    free = all(one.separation is not None for one in shown)
    with canvas((2.6,), 7.0 if free else 4.5, simulated=simulated,
                columns=2 if free else 1, sharex=False) as drawing:  # fmt: skip
        for one, (_, color) in zip(shown, _STYLES, strict=False):
            label = f"{one.run.incline_deg:g}°, run {one.run.number}"
            if free and one.separation is not None:
                _banded(drawing.axes[0], one.time_s, one.separation, row.scale, color, label)
            _banded(drawing.axes[-1], one.height_m, one.squared_speed, 1.0, color, label)
        if free:
            drawing.axes[0].set_xlabel("time since release (s)")
            drawing.axes[0].set_ylabel("separation Δz (cm)")
        drawing.axes[-1].set_xlabel("height of the top rod z (m)")
        drawing.axes[-1].set_ylabel("V² (m²/s²)")
        drawing.axes[-1].invert_xaxis()
        drawing.axes[0].legend(loc="upper left")
    return PageFigure(
        drawing.svg,
        "Separation against time and squared speed against height"
        if free
        else "Squared speed against height",
        f"Single drops: {'Δz(t) at simultaneous release and V²(z)' if free else 'V²(z)'}, with "
        "95 % bands. Dashed: the model with the protocol's coefficients.",
    )


def _banded(axes: Axes, at: Array, curve: Curve, scale: float, color: str, label: str) -> None:
    values, band = scale * curve.measured, scale * curve.u95
    axes.fill_between(at, values - band, values + band, color=color, alpha=0.3, linewidth=0)
    axes.plot(at, values, color=color, linewidth=1.1, label=label)
    axes.plot(at, scale * curve.model, "--", color=color, linewidth=0.8)


def _posterior(told: Coefficients, simulated: bool) -> PageFigure | None:
    """Contours of β and μ; none where the posterior has no spread to draw."""
    mixture = told.posterior
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
    levels = [float(ordered[np.searchsorted(held, share)]) for share in (0.95, 0.683)]
    levels.append(float(density.max()) * 1.001)
    if not all(low < high for low, high in pairwise(levels)):
        return None  # narrower than the grid
    with canvas((3.2,), 4.2, simulated=simulated) as drawing:
        (axes,) = drawing.axes
        axes.contourf(
            grid, nodes, density.T, levels=levels,
            colors=[MODEL_BAND, MODEL],
        )  # fmt: skip
        line = {one.name: one.least_squares.value for one in told.parameters}
        axes.plot(line["restitution"], line["friction"], "+", color=INK, label="least squares")
        axes.locator_params(axis="x", nbins=5)
        axes.set_xlabel("restitution β")
        axes.set_ylabel("friction μ")
        axes.legend()
    return PageFigure(
        drawing.svg,
        "Posterior of restitution and friction",
        "Posterior of β and μ: the smallest regions that contain 68.3 % and 95 %.",
        "impacts",
    )


def _spread(lines: Sequence[T]) -> list[T]:
    """Pick at most three, the outermost and one between."""
    if len(lines) <= _SHOWN:
        return list(lines)
    return [lines[n] for n in (len(lines) // 3, len(lines) * 2 // 3, len(lines) - 1)]
