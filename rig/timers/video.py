"""Where something was, frame by frame, as trackers of videos write it: t, x, y."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from rig.arrays import Array
from rig.reasons import make_reason
from rig.timers.lines import read_lines
from rig.timers.problems import ProblemList
from rig.timers.table import Row, Table
from rig.timers.vocabulary import form, is_number

FEWEST = 6
"""Frames that tell an acceleration and how much they scatter."""
_LENGTHS = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3}
_SCALES = {"t": {"": 1.0, "s": 1.0, "ms": 1e-3}, "x": _LENGTHS, "y": _LENGTHS}
"""Of each axis: what one of each unit is in s, or in m."""


class VideoTrack(NamedTuple):
    """Moments, s, and places then, m; each of shape ``(frames,)``; how many rows are left out."""

    times: Array
    x: Array
    y: Array
    unused: int


def read_video(path: str | Path) -> VideoTrack:
    """Read a table of places of one object, the first; frames without a place are left out.

    Raises
    ------
    InputError
        Another kind of file, too few frames, or values that are no numbers, at their places.
    """
    problems = ProblemList(str(path), make_reason("video_files").text)
    table = Table(enumerate(read_lines(path), 1), lambda usual, *_: usual)
    rows = list(table.rows())
    track = [row for row in rows if row.block is rows[0].block]
    above = reversed(rows[0].block.headings if rows else [])
    heading = next((row for row in above if len(_find_axes(row)) == len(_SCALES)), None)
    if heading is None:
        problems.refuse(1, "no_track")
    axes = sorted(_find_axes(heading).items())
    for name, (n, unit) in axes:
        if unit not in _SCALES[name]:
            accepted = f"a unit of this column: {', '.join(filter(None, _SCALES[name]))}"
            problems.reject(*heading.place(n), heading.cell(n), unit, accepted)
        for row in track:
            if not is_number(row.cell(n) or "0"):
                problems.reject(*row.place(n), name, row.cell(n), "a number")
    problems.raise_if_any()
    texts = [[row.cell(n) or "nan" for _, (n, _) in axes] for row in track]
    places = np.array(texts, float) * [_SCALES[name][unit] for name, (_, unit) in axes]
    times, x, y = places[~np.isnan(places).any(axis=1)].T
    if times.size < FEWEST or not np.all(np.diff(times) > 0):
        problems.refuse(1, "few_frames", frames=times.size, needed=FEWEST)
    return VideoTrack(times, x, y, len(rows) + len(table.strays) - len(track))


def _find_axes(row: Row) -> dict[str, tuple[int, str]]:
    """Return where t, x and y stand in a heading, the first of each, and their units."""
    axes = [(n, form("axis").match(text)) for n, text in enumerate(row.texts)]
    return {axis[1].lower(): (n, axis[2] or "") for n, axis in reversed(axes) if axis}
