"""Drops as rows of the project's own format: ``run,channel,time_s,state``."""

import re
from collections.abc import Callable, Iterable
from fractions import Fraction
from pathlib import Path

from rig.records import Drop, Edge
from rig.timers.lines import read_lines
from rig.timers.moments import LONGEST_DROP, TICK_HZ, moment, seconds
from rig.timers.problems import ProblemList
from rig.timers.table import Row, split_cells
from rig.timers.vocabulary import LONGEST, is_remark

HEADER = ("run", "channel", "time_s", "state")
"""Of the project's own format, in which every line is a row."""
_CELLS: tuple[tuple[str, Callable[[str], int | None], str], ...] = (
    (r"[+]?0*[1-9][0-9]{0,8}", int, "a run: a whole number from 1"),
    (r"(?!1[6-9])1?[0-9]", int, "a channel: 0 to 15"),
    (r"[^:]+", moment, "a time of a drop in seconds"),
    (r"[01]", int, "a state: 1 is blocked, 0 is clear"),
)
"""Of each column: form, how it is read, and what is accepted."""


def is_own(head: Iterable[str]) -> bool:
    """Whether lines begin as the project's own format does, perhaps below remarks."""
    plain = (line[:LONGEST] for line in head if line.strip() and not is_remark(line))
    return tuple(text.strip().lower() for text in next(plain, "").split(",")) == HEADER


def read_edges(path: str | Path) -> list[Drop]:
    """Read drops in the import format.

    Raises
    ------
    InputError
        Every fault at its place.
    """
    problems = ProblemList(str(path))
    rows = (
        Row(number, split_cells(line, ","), line)
        for number, line in enumerate(read_lines(path), 1)
        if line.strip() and not is_remark(line)
    )
    next(rows, None)  # the header
    runs = dict[int, list[tuple[int, int, bool]]]()
    for row in rows:
        if len(row.texts) != len(HEADER):
            problems.add(row.line, 1, "", "wrong_width", values=len(row.texts))
            continue
        values = list[int]()
        for n, (text, (pattern, read, accepted)) in enumerate(zip(row.texts, _CELLS, strict=True)):
            if re.fullmatch(pattern, text) and (value := read(text)) is not None:
                values.append(value)
            else:
                problems.reject(*row.place(n), HEADER[n], text, accepted)
        if len(values) < len(HEADER):
            continue
        run, channel, tick, state = values
        edges = runs.setdefault(run, [])
        first = edges[0][0] if edges else tick
        same = (edge[0] for edge in reversed(edges) if edge[1] == channel)
        begin, end = next(same, first - LONGEST_DROP), first + LONGEST_DROP
        if begin <= tick <= end:
            edges.append((tick, channel, bool(state)))
        else:
            since, until = (seconds(bound, Fraction(TICK_HZ)) for bound in (begin, end))
            accepted = f"a time from {since} s (the last of channel {channel}) to {until} s"
            problems.reject(*row.place(2), HEADER[2], row.texts[2], accepted)
    problems.raise_if_any()
    if not runs:
        problems.refuse(1, "no_edges")
    return [make_drop(run, runs[run]) for run in sorted(runs)]


def make_drop(run: int, edges: Iterable[tuple[int, int, bool]]) -> Drop:
    """Make a drop of edges in ps: in order, counted from the whole second before the first."""
    rows = sorted(edges, key=lambda edge: edge[0])  # equal times stay in their order
    start = rows[0][0] // TICK_HZ * TICK_HZ
    first = {channel: blocked for _, channel, blocked in reversed(rows)}
    clear = sum(1 << channel for channel, blocked in first.items() if not blocked)
    stamps = tuple(Edge(tick - start, channel, blocked) for tick, channel, blocked in rows)
    return Drop(run, 1, TICK_HZ, stamps, initial_state=clear)


def edges_text(drops: Iterable[Drop], hz: Callable[[Drop], float]) -> str:
    """Write drops in the import format, of which the same edges are read again.

    Parameters
    ----------
    drops
        At most one a run: the format does not know of attempts.
    hz
        Calibrated tick rate of a drop, Hz.

    Raises
    ------
    ValueError
        If two drops are of the same run.
    """
    rows = {0: ",".join(HEADER) + "\n"}
    for drop in drops:
        if drop.run in rows:
            raise ValueError(f"two drops of run {drop.run}")
        rate = Fraction(hz(drop))
        rows[drop.run] = "".join(
            f"{drop.run},{edge.channel},{seconds(edge.tick, rate)},{int(edge.blocked)}\n"
            for edge in drop.edges
        )
    return "".join(rows.values())
