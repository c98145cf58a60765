"""Edges of a file of the project's own format, as an import has them."""

from __future__ import annotations

from rig.timers.layouts import FileLayout, read_drops
from rig.timers.timer_file import read_timer_file


def read_edges(path):
    file = read_timer_file(path)
    return read_drops(file, FileLayout.own(file)).drops
