"""What `rig estimate` finds: words and tables, for the terminal and the page alike, and figures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimate.rods import resolution
from rig.report.columns import heading_of, table_parts
from rig.report.figure import Trace, chart
from rig.report.looks import MODEL
from rig.report.numbers import decimals_for, degrees, fixed, plus_minus
from rig.report.templates import sentence

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from rig.estimate.posterior import Posterior
    from rig.estimate.rods import Gain
    from rig.estimate.session import Coefficient, Coefficients, SessionEstimate
    from rig.report.columns import Part
    from rig.report.figure import Chart
    from rig.sections import Sections

SYMBOLS = {"alpha": "α", "restitution": "β", "friction": "μ", "pile_restitution": "β of the pile"}
_TEXT = ("coefficients", "alphas", "end", "impulses", "comparison", "failed")
"""In order; each is made by itself, and none where there is nothing to say."""
_PAGE = (*_TEXT, "inclines", "rods")
"""A page has a record for each rod too, or rods known by their sum."""
_STYLES = (("ring", "model"), ("square", "second"), ("mean", "ink"))
_SHARES = (0.683, 0.95)
_CURVES = {
    True: {
        "title": "Separation against time and squared speed against height",
        "words": "Δz(t) at simultaneous release and V²(z)",
    },
    False: {"title": "Squared speed against height", "words": "V²(z)"},
}
"""Whether separations are known or not."""
_FEWEST = 4  # points of the grid in the larger region


def estimate_text(found: SessionEstimate, sections: Sections, *, simulated: bool) -> str:
    """Write everything for a terminal; what cannot be written is noted in `sections`."""
    lines = ["SIMULATED DATA"] if simulated else []
    lines.append(f"{found.drops} good drop{'s' * (found.drops > 1)}, {found.edges} edges")
    for part in page_parts(found, sections, _TEXT):
        lines += part.lines
    return "\n".join(lines)


def page_parts(
    found: SessionEstimate, sections: Sections, names: Iterable[str] = _PAGE
) -> Iterator[Part]:
    """Yield tables of ``columns.txt``, each made alone."""

    def make(name: str) -> list[Part]:
        return [*table_parts(name, *_TABLES[name](found), _CELLS)]

    for name in names:
        yield from sections.make(f'The section "{heading_of(name)}"', partial(make, name)) or ()


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


def symbol(name: str) -> str:
    """Write a coefficient as its symbol; of given α's each has its chain's name."""
    what, _, chain = name.partition(" ")
    return SYMBOLS[what] + (f" of {chain}" if chain else "")


def _coefficients(found: SessionEstimate) -> tuple[Sequence[Any], list[str]]:
    words, coefficients = [f"{left}." for left in found.left_out or ()], found.coefficients
    if coefficients is None or not coefficients.parameters:
        return (), words
    return coefficients.parameters, [*words, *_coefficient_words(coefficients)]


def _coefficient_words(coefficients: Coefficients) -> Iterator[str]:
    names = [symbol(parameter.name) for parameter in coefficients.parameters]
    pairs = [
        f"{name} and {other} {fixed(coefficients.correlation[i, j], 2)}"
        for i, name in enumerate(names)
        for j, other in enumerate(names[:i])
    ]
    if pairs:
        yield f"Correlation: {', '.join(pairs)}."
    yield sentence("priors")
    yield sentence("drag", coefficients.drag)


def _alphas(found: SessionEstimate) -> tuple[Sequence[Any], list[str]]:
    if found.alphas is None:
        return (), []
    tests = {"runs": found.alphas.runs_share_alpha, "model": found.alphas.by_model}
    words = [sentence("alphas", name, test) for name, test in tests.items() if test is not None]
    contacts = found.coefficients.contact if found.coefficients else ()
    contact = {point.incline_deg: point for point in contacts}
    inclines = found.alphas.inclines
    return [(alpha, contact.get(alpha.condition.incline_deg)) for alpha in inclines], words


def _members(groups: Iterable[Any] | None, name: str) -> list[tuple[Any, Any]]:
    """Pair each group with each of its members."""
    return [(group, member) for group in groups or () for member in getattr(group, name)]


def _posterior_range(coefficient: Coefficient) -> str:
    digits = decimals_for(2.0 * coefficient.sd)
    return f"{fixed(coefficient.low, digits)} … {fixed(coefficient.high, digits)}"


def _stated(coefficient: Coefficient) -> str:
    u = f" (u {coefficient.stated.u:g})" if coefficient.stated.u else ""
    return degrees(coefficient.stated.value) + u


def _worst(lines: Iterable[Any]) -> float | None:
    errors = [line.normalized_error for line in lines]
    return max((abs(error) for error in errors if error is not None), default=None)


def _rod(gain: Gain) -> str:
    """Count rods as people do, from 1."""
    return "–".join(str(1 + rod) for rod in dict.fromkeys((gain.first, gain.last)))


_TABLES: dict[str, Callable[[SessionEstimate], tuple[Sequence[Any], list[str]]]] = {
    "coefficients": _coefficients,
    "alphas": _alphas,
    "end": lambda found: ((), [found.end_correction.sentence] if found.end_correction else []),
    "impulses": lambda found: (
        found.impulses or (),
        [] if found.impulses is None else [resolution(found.impulses)],
    ),
    "comparison": lambda found: (found.comparison or (), []),
    "failed": lambda found: ((), [f"{sentence}." for sentence in found.failed]),
    "inclines": lambda found: (_members(found.comparison, "differences"), []),
    "rods": lambda found: (_members(found.impulses, "gains"), []),
}
_CELLS: dict[str, Callable[[Any], Any]] = {
    "symbol": symbol,
    "posterior": _posterior_range,
    "stated": _stated,
    "source": lambda coefficient: "edges" if coefficient.identified else "held",
    "contact": lambda at: plus_minus(at.height, 1e3) if at.identified else "not identified",
    "worst": _worst,
    "rod": _rod,
}


def _alpha(found: SessionEstimate) -> Chart | None:
    """α against incline, and below it every run's residual."""
    if found.alphas is None:
        return None
    runs, inclines = found.alphas.runs, found.alphas.inclines
    left = [(run.run.incline_deg, run.residual / 2.0) for run in runs if run.residual is not None]
    return chart("alpha", {"runs": runs, "inclines": inclines, "left": left})


def _impulses(found: SessionEstimate) -> Chart | None:
    """ΔV of every rod beside Eq. 9, and the normalized errors of all inclines."""

    def rods(lines: Iterable[Any]) -> list[tuple[float, Gain]]:
        return [(1 + (gain.first + gain.last) / 2, gain) for _, gain in _members(lines, "gains")]

    inclines = [
        {**style, "rods": rods([line]), "label": f"{line.condition.incline_deg:g}°"}
        for line, style in _styled(found.impulses or ())
    ]
    sources = {"inclines": inclines, "rods": rods(found.impulses or ())}
    return chart("impulses", sources) if inclines else None


def _curves(found: SessionEstimate) -> Chart | None:
    """Δz(t) and V²(z) with bands (Fig. 4)."""
    drops = []
    for drop, style in _styled(found.curves or ()):
        curves = (drop.time_s, drop.separation), (drop.height_m, drop.squared_speed)
        columns = {
            name: np.column_stack((at, curve.measured, curve.u95, curve.model))
            for name, (at, curve) in zip(("separation", "speed"), curves, strict=True)
            if curve is not None
        }
        label = f"{drop.run.incline_deg:g}°, run {drop.run.number}"
        drops.append({**style, "label": label, **columns})
    apart = any("separation" in drop for drop in drops)
    return chart("curves", {"drops": drops}, **_CURVES[apart]) if drops else None


def _posterior(found: SessionEstimate) -> Chart | None:
    """Draw the regions of β and μ that hold 68.3 % and 95 %; `None` where they have no spread."""
    parameters = found.coefficients.parameters if found.coefficients else ()
    best = {parameter.name: parameter.least_squares for parameter in parameters}
    if found.coefficients is None or not {"restitution", "friction"} <= best.keys():
        return None
    assert found.coefficients.posterior is not None
    regions = _regions(found.coefficients.posterior)
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
