"""Pictures of a simulated fall: rods with their tilt, strings tight or slack, the board."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.report.figure import Chart, Panel, PlotAxis, Trace
from rig.report.layout import lay_out
from rig.report.looks import INK, MODEL, MUTED, SECOND
from rig.report.svg import figure_svg

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rig.films import Film, Point

PICTURES = 6
_APART_M = 0.26
_LOW_M, _HIGH_M = -0.25, 0.55


def film_figure(film: Film, pictures: int = PICTURES) -> Chart:
    """Draw moments of a fall side by side, from the front and, below, along the rods.

    Parameters
    ----------
    film
        What fell.
    pictures
        How many, equally far apart from the first touch to the end.
    """
    begin = min(time for time in film.touched_s if time is not None)
    step = (film.times_s[-1] - begin) / (pictures - 1)
    moments = [film.nearest(begin + number * step) for number in range(pictures)]
    places = [_APART_M * number for number in range(pictures)]
    names = {
        place: f"{1e3 * film.times_s[moment]:.0f} ms"
        for place, moment in zip(places, moments, strict=True)
    }
    slope = math.tan(math.radians(film.incline_deg))
    front: list[Trace] = []
    side: list[Trace] = []
    for place, moment in zip(places, moments, strict=True):
        both = film.left[moment], film.right[moment]
        strings = [
            (low, high, loose)
            for ends, slack in zip(both, film.slack(moment), strict=True)
            for low, high, loose in zip(ends, ends[1:], slack, strict=False)
        ]
        tight = [(low, high) for low, high, loose in strings if not loose]
        slack = [(low, high) for low, high, loose in strings if loose]
        front += [
            _lines(tight, place, MUTED),
            _lines(slack, place, SECOND),
            _lines(zip(*both, strict=True), place, INK),
        ]
        middles = film.middles(moment)
        board = [-0.08, 0.12]
        side += [
            Trace("", [place + y for y in board], [film.board_m - y * slope for y in board],
                   "line", MODEL),
            Trace("", [place + y for _, y, _ in middles], [z for _, _, z in middles], "ring", INK),
        ]  # fmt: skip
    across = PlotAxis("time since release", names, (-0.1, places[-1] + 0.14))
    words = "Slack strings are orange. Below: along the rods."
    title = f"A simulated fall at {film.incline_deg:g}°"
    panels = [
        Panel(across, PlotAxis(label, limits=(_LOW_M, _HIGH_M)), series, 170.0)
        for label, series in (("height (m)", front), ("height (m), along the rods", side))
    ]
    return Chart(title, f"{title}: the impact chain from the front. {words}", panels, True)


def film_svg(film: Film) -> str:
    """Draw a fall for a file."""
    figure = film_figure(film)
    return figure_svg(lay_out(figure), figure.title)


def _lines(pairs: Iterable[tuple[Point, Point]], place: float, color: int) -> Trace:
    """Lines between points, with gaps between one line and the next."""
    pairs = list(pairs)
    xs = [x for low, high in pairs for x in (place + low[0], place + high[0], math.nan)]
    zs = [z for low, high in pairs for z in (low[2], high[2], math.nan)]
    return Trace("", xs, zs, "line", color)
