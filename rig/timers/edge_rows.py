"""Drops as rows of the project's own format: ``run,channel,time_s,state``."""

from __future__ import annotations

from fractions import Fraction
from operator import attrgetter
from typing import TYPE_CHECKING

from rig.timers.moments import seconds

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rig.records import Drop

HEADER = ("run", "channel", "time_s", "state")
"""Of the project's own format, in which every line is a row."""


def edges_text(
    drops: Iterable[Drop], hz: Callable[[Drop], float | Fraction] = attrgetter("tick_hz")
) -> str:
    """Write drops in the import format, of which the same edges are read again.

    Parameters
    ----------
    drops
        At most one a run: the format does not know of attempts.
    hz
        Calibrated tick rate of a drop, Hz; by default its nominal rate.

    Raises
    ------
    ValueError
        If two drops are of the same run.
    """
    rows, seen = [",".join(HEADER) + "\n"], set[int]()
    for drop in drops:
        if drop.run in seen:
            raise ValueError(f"two drops of run {drop.run}")
        seen.add(drop.run)
        rate = Fraction(hz(drop))
        rows += [
            f"{drop.run},{edge.channel},{seconds(edge.tick, rate)},{int(edge.blocked)}\n"
            for edge in drop.edges
        ]
    return "".join(rows)
