"""Pictures of a simulated fall: rods with their tilt, strings tight or slack, the pile."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.report.canvas import INK, MODEL, MUTED, SECOND, canvas

if TYPE_CHECKING:
    from collections.abc import Iterable

    from matplotlib.patches import Patch

    from rig.films import Film, Point

PICTURES = 6
_BOARD_M = (-0.1, 0.2)


def film_figure(film: Film, pictures: int = PICTURES) -> str:
    """Draw moments of a fall side by side, from the front and, below, along the rods.

    Parameters
    ----------
    film
        What fell.
    pictures
        How many, equally far apart from the first touch to the end.

    Returns
    -------
    str
        SVG.
    """
    begin = min(time for time in film.touched_s if time is not None)
    step = (film.times_s[-1] - begin) / (pictures - 1)
    moments = [film.nearest(begin + n * step) for n in range(pictures)]
    slope = math.tan(math.radians(film.incline_deg))
    with canvas((3.4, 3.4), 8.0, simulated=True, columns=pictures, sharex=False) as drawing:
        for number, moment in enumerate(moments):
            front, side = drawing.axes[number], drawing.axes[number + pictures]
            both = film.left[moment], film.right[moment]
            strings = [
                (low, high, loose)
                for ends, slack in zip(both, film.slack(moment), strict=True)
                for low, high, loose in zip(ends, ends[1:], slack, strict=False)
            ]
            tight = [(low, high) for low, high, loose in strings if not loose]
            dotted = [(low, high) for low, high, loose in strings if loose]
            front.plot(*_lines(tight), color=MUTED, linewidth=0.7)
            front.plot(*_lines(dotted), color=SECOND, linewidth=0.7, linestyle=":")
            front.plot(*_lines(zip(*both, strict=True)), color=INK, linewidth=1.6)
            for (_, y, z), radius in zip(film.middles(moment), film.radii_m, strict=True):
                side.add_patch(_disc(y, z, radius))
            side.plot(_BOARD_M, [film.board_m - y * slope for y in _BOARD_M], color=MODEL)
            for axes, reach in ((front, (-0.08, 0.08)), (side, _BOARD_M)):
                axes.set_xlim(*reach)
                axes.set_ylim(-0.25, 0.55)
                axes.set_aspect("equal")
                axes.set_xticks([])
                axes.set_yticks([0.0, 0.5] if number == 0 else [])
            front.set_title(f"{1e3 * film.times_s[moment]:.0f} ms")
        drawing.axes[0].set_ylabel("height (m)")
        drawing.axes[pictures].set_ylabel("height (m), along the rods")
    return drawing.svg


def _lines(pairs: Iterable[tuple[Point, Point]]) -> tuple[list[float], list[float]]:
    """X and z of lines between points, with gaps between one line and the next."""
    both = list(pairs)
    return (
        [x for one, other in both for x in (one[0], other[0], math.nan)],
        [z for one, other in both for z in (one[2], other[2], math.nan)],
    )


def _disc(x: float, y: float, radius: float) -> Patch:
    from matplotlib.patches import Circle  # noqa: PLC0415 - matplotlib comes with the canvas

    return Circle((x, y), radius, facecolor="none", edgecolor=INK, linewidth=0.8)
