"""Where something was, frame by frame, as trackers of videos write it: t, x, y."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.timers.lines import read_lines
from rig.timers.problems import ProblemList
from rig.timers.table import RowBlock, Table
from rig.timers.vocabulary import is_number

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from rig.timers.table import Row

    Array = NDArray[np.float64]

FEWEST = 6
"""Frames that tell an acceleration and how much they scatter."""
_NAMES = {name: re.compile(rf"^{name}(?![A-Za-z])", re.IGNORECASE) for name in "txy"}
_SCALES = {"s": 1.0, "ms": 1e-3, "m": 1.0, "cm": 1e-2, "mm": 1e-3}
_HINT = (
    "accepted is what Tracker copies or exports: columns t, x and y with a heading, in s and m "
    "where it says no unit"
)


class VideoTrack(NamedTuple):
    """Moments, s, and places then, m; each of shape ``(frames,)``."""

    times: Array
    x: Array
    y: Array


def read_video(path: str | os.PathLike[str]) -> VideoTrack:
    """Read a table of places; frames without one are left out.

    Raises
    ------
    InputError
        Another kind of file, too few frames, or values that are no numbers, at their places.
    """
    problems = ProblemList(str(path), _HINT)
    block, rows = next(Table(read_lines(path)).blocks(), (RowBlock(), iter(())))
    first = next(rows, None)
    heading = next(filter(_has_columns, reversed(block.headings)), None)
    if first is None or heading is None:
        problems.refuse(1, 1, "no_track")
    at = {name: _column(heading, name) for name in _NAMES}
    scales = {name: _scale(heading, n, problems) for name, n in at.items()}
    frames: list[list[float]] = []
    for row in itertools.chain([first], rows):
        texts = {name: row.cell(n) for name, n in at.items()}
        if not all(texts.values()):
            continue
        wrong = [name for name, text in texts.items() if not is_number(text)]
        for name in wrong[:1]:
            problems.reject(row.line, row.column(at[name]), name, texts[name], "a number")
        if not wrong:
            frames.append([scales[name] * float(text) for name, text in texts.items()])
    problems.raise_if_any()
    track = VideoTrack(*np.array(frames, dtype=float).reshape(-1, 3).T)
    if track.times.size < FEWEST or not np.all(np.diff(track.times) > 0):
        problems.refuse(1, 1, "few_frames", frames=track.times.size, needed=FEWEST)
    return track


def _has_columns(row: Row) -> bool:
    return all(any(pattern.search(text) for text in row.texts) for pattern in _NAMES.values())


def _column(heading: Row, name: str) -> int:
    return next(n for n, text in enumerate(heading.texts) if _NAMES[name].search(text))


def _scale(heading: Row, at: int, problems: ProblemList) -> float:
    text = heading.texts[at]
    match = re.search(r"[(\[/_]\s*([^\W\d_]+)", text)
    if match is None:
        return 1.0
    is_time = text[0].lower() == "t"
    if match[1] not in _SCALES or (match[1] in {"s", "ms"}) is not is_time:
        accepted = "a unit of this column: s, ms; m, cm, mm"
        problems.reject(heading.line, heading.column(at), text, match[1], accepted)
        return 1.0
    return _SCALES[match[1]]
