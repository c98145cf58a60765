"""Edges of a file of the project's own format, as an import has them."""

from __future__ import annotations

from rig.timers.edge_rows import read_edges as read_rows
from rig.timers.lines import read_lines
from rig.timers.problems import ProblemList


def read_edges(path):
    return read_rows(enumerate(read_lines(path), 1), ProblemList(str(path)))
