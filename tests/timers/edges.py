"""Edges of a file of the project's own format, as an import has them."""

from __future__ import annotations

from contextlib import closing

from rig.timers.edge_rows import read_edges as read_rows
from rig.timers.lines import read_lines
from rig.timers.problems import ProblemList


def read_edges(path):
    with closing(read_lines(path)) as lines:
        return read_rows(enumerate(lines, 1), ProblemList(str(path)))
