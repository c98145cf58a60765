"""Pictures of what `rig estimate` finds."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.measurands import SEPARATION
from rig.report.canvas import INK, MODEL, MODEL_BAND, MUTED, PAPER, SECOND, canvas
from rig.report.embed import PageFigure
from rig.report.estimate import has_free_chain

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes

    from rig.sections import Sections

_SHOWN = 3
_STYLES = (("o", MODEL), ("s", SECOND), ("^", INK))


def estimate_pictures(found: Mapping[str, Any], sections: Sections) -> dict[str, PageFigure]:
    """Draw everything there is, by file name without its ending.

    Parameters
    ----------
    found
        What ``rig estimate --json`` prints.
    sections
        Where a picture that cannot be drawn is noted.
    """
    wanted: dict[str, tuple[str, Callable[[Mapping[str, Any]], PageFigure | None]]] = {}
    if found.get("alpha"):
        wanted["alpha"] = "The picture of α", _alpha
    if found.get("impulses"):
        wanted["impulses"] = "The picture of the impulses", _impulses
    if found.get("curves"):
        wanted["curves"] = "The picture of Δz(t) and V²(z)", _curves
        if not has_free_chain(found):
            wanted["curves"] = "The picture of V²(z)", _curves
    if {"restitution", "friction"} <= set((found.get("posterior") or {}).get("names", ())):
        wanted["posterior"] = "The picture of the posterior", _posterior
    drawn = {
        name: sections.make(what, partial(draw, found)) for name, (what, draw) in wanted.items()
    }
    return {name: picture for name, picture in drawn.items() if picture is not None}


def _alpha(found: Mapping[str, Any]) -> PageFigure:
    """α against incline, and below it every run's residual."""
    inclines, runs = found["alpha"]["inclines"], found["alpha"]["runs"]
    left = [run for run in runs if "residual" in run]
    with canvas((2.6, 1.6) if left else (2.6,), simulated=found["simulated"]) as drawing:
        top = drawing.axes[0]
        top.plot(
            [run["incline_deg"] for run in runs],
            [run["alpha"]["value"] for run in runs],
            "o", color=MUTED, markersize=3, alpha=0.5, markeredgewidth=0, label="single runs",
        )  # fmt: skip
        fitted = [line for line in inclines if "model" in line]
        top.plot(
            [line["incline_deg"] for line in fitted],
            [line["model"] for line in fitted],
            "_", color=MODEL, markersize=16, label="fitted coefficients",
        )  # fmt: skip
        top.errorbar(
            [line["incline_deg"] for line in inclines],
            [line["alpha"]["value"] for line in inclines],
            yerr=[line["alpha"]["U95"] for line in inclines],
            fmt="o", color=INK, markersize=4, label="incline ± U (95 %)",
        )  # fmt: skip
        top.set_ylabel("α")
        top.legend()
        if left:
            low = drawing.axes[1]
            low.axhspan(-2, 2, color=MODEL_BAND, alpha=0.6, linewidth=0)
            low.plot(
                [run["incline_deg"] for run in left],
                [run["residual"] for run in left],
                "o", color=MODEL, markersize=3, markeredgewidth=0,
            )  # fmt: skip
            low.set_ylabel("residual / u")
        drawing.axes[-1].set_xlabel("inclination of the surface (°)")
    return PageFigure(
        drawing.svg,
        "Impact coefficient against inclination, with residuals",
        "The best single α of every incline and run; below, each run less the fitted coefficients, "
        "in standard uncertainties (band: ±2).",
    )


def _impulses(found: Mapping[str, Any]) -> PageFigure:
    """ΔV of every rod beside Eq. 9, and the normalized errors of all inclines."""
    lines = found["impulses"]["inclines"]
    shown = _spread(lines)
    with canvas((2.6, 1.6), simulated=found["simulated"]) as drawing:
        top, low = drawing.axes
        for line, (marker, color) in zip(shown, _STYLES, strict=False):
            groups = line["groups"]
            rods = [sum(group["rods"]) / 2 for group in groups]
            top.plot(rods, [group["eq9_m_s"] for group in groups], "-", color=color, linewidth=1)
            top.errorbar(
                rods,
                [group["gain_m_s"]["value"] for group in groups],
                yerr=[group["gain_m_s"]["U95"] for group in groups],
                fmt=marker, color=color, markerfacecolor=PAPER, markersize=4,
                label=f"{line['incline_deg']:g}° ± U (95 %)",
            )  # fmt: skip
        gains = [
            gain
            for line in shown
            for group in line["groups"]
            for gain in (group["eq9_m_s"], group["gain_m_s"]["value"])
        ]
        if max(gains, default=0.0) > 0.0:  # α may be nothing, and noise less
            top.set_yscale("log")
        top.set_ylabel("speed gained ΔV (m/s)")
        top.legend(title="lines: Eq. 9")
        low.axhspan(-1, 1, color=MODEL_BAND, alpha=0.6, linewidth=0)
        for line in lines:
            low.plot(
                [sum(group["rods"]) / 2 for group in line["groups"]],
                [group["normalized_error"] for group in line["groups"]],
                "o", color=MODEL, markersize=3, alpha=0.6, markeredgewidth=0,
            )  # fmt: skip
        low.set_ylabel("Eₙ, all inclines")
        low.set_xlabel("rod, from the bottom")
    return PageFigure(
        drawing.svg,
        "Speed gained from each rod's impact",
        "Speed that the chain gains as each rod strikes, as measured and by Eq. 9 with the best α "
        "of the incline; below, their normalized errors.",
    )


def _curves(found: Mapping[str, Any]) -> PageFigure:
    """Δz(t) and V²(z) with bands (Fig. 4)."""
    curves = _spread(found["curves"])
    row = SEPARATION
    free = all(SEPARATION.name in curve for curve in curves)
    with canvas((2.6,), 7.0 if free else 4.5, simulated=found["simulated"],
                columns=2 if free else 1, sharex=False) as drawing:  # fmt: skip
        for curve, (_, color) in zip(curves, _STYLES, strict=False):
            label = f"{curve['incline_deg']:g}°, run {curve['run']}"
            if free:
                axes = drawing.axes[0]
                _banded(axes, curve["time_s"], curve, row.name, row.scale, color, label)
            axes = drawing.axes[-1]
            _banded(axes, curve["height_m"], curve, "speed2_m2_s2", 1.0, color, label)
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
        "95 % bands; dashed, the model with the protocol's coefficients.",
    )


def _banded(
    axes: Axes,
    at: Sequence[float],
    curve: Mapping[str, Any],
    key: str,
    scale: float,
    color: str,
    label: str,
) -> None:
    values = scale * np.array(curve[key])
    band = scale * np.array(curve[f"{key}_U95"])
    axes.fill_between(at, values - band, values + band, color=color, alpha=0.3, linewidth=0)
    axes.plot(at, values, color=color, linewidth=1.1, label=label)
    axes.plot(at, scale * np.array(curve[f"{key}_model"]), "--", color=color, linewidth=0.8)


def _posterior(found: Mapping[str, Any]) -> PageFigure | None:
    """Contours of β and μ; none where the posterior has no spread to draw."""
    mixture = found["posterior"]
    beta, mu = (mixture["names"].index(name) for name in ("restitution", "friction"))
    weights = np.array(mixture["weights"])
    means, sds = np.array(mixture["means"]), np.array(mixture["sds"])
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
    with canvas((3.2,), 4.2, simulated=found["simulated"]) as drawing:
        (axes,) = drawing.axes
        axes.contourf(
            grid, nodes, density.T, levels=levels,
            colors=[MODEL_BAND, MODEL],
        )  # fmt: skip
        line = {one["name"]: one["least_squares"]["value"] for one in found["parameters"]}
        axes.plot(line["restitution"], line["friction"], "+", color=INK, label="least squares")
        axes.set_xlabel("restitution β")
        axes.set_ylabel("friction μ")
        axes.legend()
    return PageFigure(
        drawing.svg,
        "Posterior of restitution and friction",
        "Posterior of β and μ: smallest regions that hold 68.3 % and 95 %.",
    )


def _spread(lines: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Pick at most three, the outermost and one between."""
    if len(lines) <= _SHOWN:
        return list(lines)
    return [lines[n] for n in (len(lines) // 3, len(lines) * 2 // 3, len(lines) - 1)]
