"""Pictures of a simulated fall: rods with their tilt, strings tight or slack, the board."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.report.figure import Panel, PlotAxis, chart, series
from rig.report.looks import INK, MODEL, MUTED, SECOND

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rig.films import Film, Point
    from rig.report.figure import Chart, Trace

PICTURES = 6
_APART_M = 0.26
_BOARD_M = (-0.08, 0.12)
_LIMITS_M = (-0.25, 0.55)


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
    places = {_APART_M * n: film.nearest(begin + n * step) for n in range(pictures)}
    names = {place: f"{1e3 * film.times_s[moment]:.0f} ms" for place, moment in places.items()}
    across = PlotAxis("time since release", names, (-0.1, [*places][-1] + 0.14))
    panels = [
        Panel(
            across,
            PlotAxis(label, limits=_LIMITS_M),
            [trace for place, moment in places.items() for trace in draw(film, moment, place)],
            170.0,
        )
        for label, draw in (("height (m)", _front), ("height (m), along the rods", _side))
    ]
    return chart("film", panels, incline=f"{film.incline_deg:g}")


def _front(film: Film, moment: int, place: float) -> Iterator[Trace]:
    ends = film.left[moment], film.right[moment]
    strings = [
        (low, high, loose)
        for side, slack in zip(ends, film.slack(moment), strict=True)
        for low, high, loose in zip(side, side[1:], slack, strict=False)
    ]
    for color, slack in ((MUTED, False), (SECOND, True)):
        yield _lines(((low, high) for low, high, loose in strings if loose == slack), place, color)
    yield _lines(zip(*ends, strict=True), place, INK)


def _side(film: Film, moment: int, place: float) -> Iterator[Trace]:
    slope, middles = math.tan(math.radians(film.incline_deg)), film.middles(moment)
    heights = [film.board_m - y * slope for y in _BOARD_M]
    yield series("", [place + y for y in _BOARD_M], heights, "line", MODEL)
    yield series("", [place + y for _, y, _ in middles], [z for _, _, z in middles], "ring")


def _lines(pairs: Iterable[tuple[Point, Point]], place: float, color: int) -> Trace:
    """Lines between points, with gaps between one line and the next."""
    points = [point for pair in pairs for point in (*pair, (math.nan,) * 3)]
    return series("", [place + x for x, _, _ in points], [z for _, _, z in points], "line", color)
