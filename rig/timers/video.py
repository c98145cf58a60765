"""Where something was, frame by frame, as trackers of videos write it: t, x, y."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.timers.lines import read_lines
from rig.timers.problems import ProblemList
from rig.timers.table import RowBlock, Table
from rig.timers.vocabulary import form, is_number

if TYPE_CHECKING:
    from pathlib import Path

    from rig.arrays import Array
    from rig.timers.table import Row

FEWEST = 6
"""Frames that tell an acceleration and how much they scatter."""
_LENGTHS = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3}
_SCALES = {"t": {"": 1.0, "s": 1.0, "ms": 1e-3}, "x": _LENGTHS, "y": _LENGTHS}
_HINT = (
    "accepted is what Tracker copies or exports: columns t, x and y with a heading, in s and m "
    "where it says no unit"
)


class VideoTrack(NamedTuple):
    """Moments, s, and places then, m; each of shape ``(frames,)``."""

    times: Array
    x: Array
    y: Array


def read_video(path: str | Path) -> VideoTrack:
    """Read a table of places; frames without one are left out.

    Raises
    ------
    InputError
        Another kind of file, too few frames, or values that are no numbers, at their places.
    """
    problems = ProblemList(str(path), _HINT)
    block, rows = next(Table(enumerate(read_lines(path), 1)).blocks(), (RowBlock(), iter(())))
    columns = next(filter(None, map(_find_columns, reversed(block.headings))), {})
    if not columns:
        problems.refuse(1, 1, "no_track")
    scales = {}
    for name, (n, heading, unit) in columns.items():
        scales[name] = _SCALES[name].get(unit, 0.0)
        if not scales[name]:
            accepted, text = "a unit of this column: s, ms; m, cm, mm", heading.cell(n)
            problems.reject(*heading.place(n), text, unit, accepted)
    frames: list[list[float]] = []
    for row in rows:
        texts = {name: row.cell(n) for name, (n, _, _) in columns.items()}
        wrong = [name for name, text in texts.items() if text and not is_number(text)]
        for name in wrong:
            problems.reject(*row.place(columns[name][0]), name, texts[name], "a number")
        if not wrong and all(texts.values()):
            frames.append([scales[name] * float(text) for name, text in texts.items()])
    problems.raise_if_any()
    track = VideoTrack(*np.array(frames, dtype=float).reshape(-1, 3).T)
    if track.times.size < FEWEST or not np.all(np.diff(track.times) > 0):
        problems.refuse(1, 1, "few_frames", frames=track.times.size, needed=FEWEST)
    return track


def _find_columns(row: Row) -> dict[str, tuple[int, Row, str]]:
    """Return where t, x and y stand in a heading, and their units; nothing if one of them lacks."""
    columns = {}
    for n, text in reversed(list(enumerate(row.texts))):
        if name := form("axis").match(text):
            unit = form("axis unit").search(text)
            columns[name[1].lower()] = n, row, unit[1] if unit else ""
    return dict(sorted(columns.items())) if len(columns) == len(_SCALES) else {}
