"""Pictures of a simulated fall: rods with their tilt, strings tight or slack, the board."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rig.report.figure import chart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.films import Film, Point
    from rig.report.figure import Chart

_APART_M = 0.26
_BOARD_M = (-0.08, 0.12)
_LIMITS_M = (-0.25, 0.55)
_GAP = (math.nan,) * 3


def film_figure(film: Film, pictures: int = 6) -> Chart:
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
    slope = math.tan(math.radians(film.incline_deg))
    middles = [
        (place + y, z) for place, moment in places.items() for _, y, z in film.middles(moment)
    ]
    boards = [[(place + y, film.board_m - y * slope) for y in _BOARD_M] for place in places]
    sources = {
        "front": [
            lines for place, moment in places.items() for lines in _front(film, moment, place)
        ],
        "boards": [{"points": points} for points in boards],
        "rods": middles,
        "x_axis": {"names": names, "limits": (-0.1, [*places][-1] + 0.14)},
        "y_axis": {"limits": _LIMITS_M},
    }
    return chart("film", sources, incline=f"{film.incline_deg:g}")


def _front(film: Film, moment: int, place: float) -> Iterator[dict[str, Any]]:
    """Yield strings that are tight, those that are slack, and rods, with gaps between them."""
    ends = film.left[moment], film.right[moment]
    lines: dict[str, list[Point]] = {"muted": [], "second": [], "ink": []}
    for side, slack in zip(ends, film.slack(moment), strict=True):
        for low, high, loose in zip(side, side[1:], slack, strict=False):
            lines["second" if loose else "muted"] += [low, high, _GAP]
    for rod in zip(*ends, strict=True):
        lines["ink"] += [*rod, _GAP]
    for color, points in lines.items():
        yield {"color": color, "points": [(place + x, z) for x, _, z in points]}
