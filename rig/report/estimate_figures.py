"""Figures of what `rig estimate` finds."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.report.figure import Trace, chart
from rig.report.looks import MODEL

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.estimate.posterior import Posterior
    from rig.estimate.session import SessionEstimate
    from rig.report.figure import Chart
    from rig.sections import Sections

_STYLES = (("ring", "model"), ("square", "second"), ("mean", "ink"))
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
    drawn = {
        name: sections.make(f"The picture of the {name}", partial(draw, found))
        for name, draw in _PICTURES.items()
    }
    return {name: figure for name, figure in drawn.items() if figure is not None}


def _alpha(found: SessionEstimate) -> Chart | None:
    """α against incline, and below it every run's residual."""
    if found.alphas is None:
        return None
    runs, inclines = found.alphas.runs, found.alphas.inclines
    left = [(run.run.incline_deg, run.residual / 2.0) for run in runs if run.residual is not None]
    return chart("alpha", {"runs": runs, "inclines": inclines, "left": left})


def _impulses(found: SessionEstimate) -> Chart | None:
    """ΔV of every rod beside Eq. 9, and the normalized errors of all inclines."""
    lines = found.impulses or ()
    inclines = [{**style, "line": line, "gains": line.gains} for line, style in _styled(lines)]
    sources = {"inclines": inclines, "gains": [gain for line in lines for gain in line.gains]}
    return chart("impulses", sources) if lines else None


def _curves(found: SessionEstimate) -> Chart | None:
    """Δz(t) and V²(z) with bands (Fig. 4)."""
    drops = [{**style, "drop": drop} for drop, style in _styled(found.curves or ())]
    apart = any(drop["drop"].separation for drop in drops)
    return chart("curves" if apart else "speeds", {"drops": drops}) if drops else None


def _posterior(found: SessionEstimate) -> Chart | None:
    """Draw the regions of β and μ that hold 68.3 % and 95 %; `None` where they have no spread."""
    fit = found.coefficients
    best = {parameter.name: parameter.least_squares for parameter in fit.parameters} if fit else {}
    if not fit or not fit.posterior or not {"restitution", "friction"} <= best.keys():
        return None
    regions = _regions(fit.posterior)
    return None if regions is None else chart("posterior", {"best": [best], "traces": [regions]})


def _regions(mixture: Posterior) -> Trace | None:
    """Return what share the smallest region holds on whose edge a point lies, with two levels."""
    beta, mu = (mixture.names.index(name) for name in ("restitution", "friction"))
    kept = mixture.weights > 1e-6 * mixture.weights.max()
    logs, sds = np.log(mixture.weights[kept]), mixture.sds[kept, beta]
    means, places = mixture.means[kept, beta], mixture.means[kept, mu]
    low, high = (means - 4.5 * sds).min(), (means + 4.5 * sds).max()
    if np.ptp(places) <= 0.0 or high <= low:
        return None
    # Smooth from node to node: more of them for the eye.
    nodes, grid = np.linspace(places.min(), places.max(), 161), np.linspace(low, high, 121)
    logs, centre, width = (np.interp(nodes, places, values) for values in (logs, means, sds))
    density = np.exp(logs - 0.5 * ((grid[:, None] - centre) / width) ** 2) / width
    densest = np.argsort(density, axis=None)[::-1]
    held = np.empty(density.size)
    held[densest] = np.cumsum(density.ravel()[densest]) / density.sum()
    if not _FEWEST < np.sum(held < _SHARES[1]) < held.size:
        return None  # narrower than the grid
    return Trace("", nodes.tolist(), grid.tolist(), "levels", MODEL, _SHARES, z=held.tolist())


def _styled(lines: Sequence[Any]) -> Iterator[tuple[Any, dict[str, str]]]:
    """Pick at most three, the outermost and one between, each with a look of its own."""
    number = len(lines)
    if number > len(_STYLES):
        lines = [lines[n] for n in (number // 3, number * 2 // 3, number - 1)]
    for line, (role, color) in zip(lines, _STYLES, strict=False):
        yield line, {"role": role, "color": color}


_PICTURES = {"alpha": _alpha, "impulses": _impulses, "curves": _curves, "posterior": _posterior}
