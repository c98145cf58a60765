"""Figures of the results of `rig estimate`."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rig.estimate.posterior import Posterior
from rig.estimate.session import SessionEstimate
from rig.report.figure import Chart, Trace, chart
from rig.report.looks import MODEL
from rig.sections import Sections

_STYLES = (("ring", "model"), ("square", "second"), ("mean", "ink"))
_SHARES = (0.683, 0.95)
_FEWEST = 4  # least number of grid points in the larger region


def estimate_pictures(found: SessionEstimate, sections: Sections) -> dict[str, Chart]:
    """Return all available figures, by file name without suffix.

    Parameters
    ----------
    found
        Results of ``rig estimate``.
    sections
        Collects the names of failed figures.
    """
    figures: dict[str, Chart] = {}
    for name, draw in _PICTURES.items():
        with sections.alone(f"The picture of the {name}"):
            if (figure := draw(found)) is not None:
                figures[name] = figure
    return figures


def _alpha(found: SessionEstimate) -> Chart | None:
    """Return the figure of α against incline, with every run's residual below."""
    return None if found.alphas is None else chart("alpha", found.alphas._asdict())


def _impulses(found: SessionEstimate) -> Chart | None:
    """Return the figure of each rod's ΔV with Eq. 9, and the normalized errors of all inclines."""
    lines = found.impulses or ()
    inclines = [{**styled, "gains": styled["line"].gains} for styled in _style_lines(lines)]
    sources = {"inclines": inclines, "gains": [gain for line in lines for gain in line.gains]}
    return chart("impulses", sources) if lines else None


def _curves(found: SessionEstimate) -> Chart | None:
    """Return the figure of Δz(t) and V²(z) with bands (Fig. 4)."""
    drops = [*_style_lines(found.curves or ())]
    apart = any(drop["line"].separation for drop in drops)
    return chart("curves" if apart else "speeds", {"drops": drops}) if drops else None


def _posterior(found: SessionEstimate) -> Chart | None:
    """Return the figure of the 68.3 % and 95 % regions of β and μ; `None` without a spread."""
    fit = found.coefficients
    best = {parameter.name: parameter.least_squares for parameter in fit.parameters} if fit else {}
    if not fit or not {"restitution", "friction"} <= best.keys():
        return None
    regions = _regions(fit.posterior)
    return None if regions is None else chart("posterior", {"best": [best], "traces": [regions]})


def _regions(mixture: Posterior) -> Trace | None:
    """Return the probability inside the density contour through each point, with two levels."""
    beta, mu = (mixture.names.index(name) for name in ("restitution", "friction"))
    kept = mixture.weights > 1e-6 * mixture.weights.max()
    logs, sds = np.log(mixture.weights[kept]), mixture.sds[kept, beta]
    means, places = mixture.means[kept, beta], mixture.means[kept, mu]
    low, high = (means - 4.5 * sds).min(), (means + 4.5 * sds).max()
    if np.ptp(places) <= 0.0 or high <= low:
        return None
    # Interpolate between nodes, for a smooth contour.
    nodes, grid = np.linspace(places.min(), places.max(), 161), np.linspace(low, high, 121)
    logs, centre, width = (np.interp(nodes, places, values) for values in (logs, means, sds))
    density = np.exp(logs - 0.5 * ((grid[:, None] - centre) / width) ** 2) / width
    densest = np.argsort(density, axis=None)[::-1]
    held = np.empty(density.size)
    held[densest] = np.cumsum(density.ravel()[densest]) / density.sum()
    if not _FEWEST < np.sum(held < _SHARES[1]) < held.size:
        return None  # the region is narrower than the grid
    return Trace("", nodes.tolist(), grid.tolist(), "levels", MODEL, _SHARES, z=held.tolist())


def _style_lines(lines: Sequence[Any]) -> Iterator[dict[str, Any]]:
    """Yield at most three items, the outermost and one between, each with its own style."""
    number = len(lines)
    if number > len(_STYLES):
        lines = [lines[n] for n in (number // 3, number * 2 // 3, number - 1)]
    for line, (role, color) in zip(lines, _STYLES, strict=False):
        yield {"line": line, "role": role, "color": color}


_PICTURES = {"alpha": _alpha, "impulses": _impulses, "curves": _curves, "posterior": _posterior}
