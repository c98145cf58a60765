"""Edges from any timer as CSV: ``run,channel,time_s,state``, state 1 = beam blocked.

Times are read as decimals and kept to the picosecond, so what a file says is what is analysed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.timers.layouts import FileLayout, read_drops
from rig.timers.problems import ProblemList
from rig.timers.table import HEADER
from rig.timers.timer_file import read_timer_file

if TYPE_CHECKING:
    import os

    from rig.records import Drop


def read_edges(path: str | os.PathLike[str]) -> list[Drop]:
    """Read the edges of all runs of a file of the project's own format.

    Accepts a byte order mark, any line ends, blank lines, comment lines (``#``) and spaces around
    values. Rows are in order of time within a run and channel; rows of several channels may come
    one channel after another.

    Returns
    -------
    list of Drop
        One a run, by run number; first attempts, no certificate, ticks of 1 ps counted from the
        whole second at or below the run's first edge. A channel whose first edge is a clearing is
        taken to be blocked in `initial_state`.

    Raises
    ------
    InputError
        Every fault of the file at its line and column (the first 50 of them).
    """
    file = read_timer_file(path)
    if not file.is_own:
        ProblemList(str(path)).refuse(1, 1, "wrong_header", header=",".join(HEADER))
    return read_drops(file, FileLayout.own(file)).drops
