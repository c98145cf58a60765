"""Edges from any timer as CSV: ``run,channel,time_s,state``, state 1 = beam blocked.

Times are read as decimals and kept to the picosecond, so what a file says is what is analysed.
"""

from __future__ import annotations

import csv
import io
import re
from collections import defaultdict
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from rig.boards import GATES
from rig.errors import InputError
from rig.files import read_input
from rig.records import Drop, Edge
from rig.timers.problems import Lines, ProblemList

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator, Mapping

HEADER = ("run", "channel", "time_s", "state")
TICK_HZ = 10**12
MAX_BYTES = 200_000_000
MAX_SPAN_S = 3600
"""A drop lasts half a second; an hour inside one run means a wrong unit or a wrong run."""

_WHOLE = re.compile(r"[+-]?[0-9]{1,9}")
_DECIMAL = re.compile(r"([+-]?)([0-9]{0,30})(?:\.([0-9]{0,60}))?(?:[eE]([+-]?[0-9]{1,2}))?")


def read_edges(path: str | os.PathLike[str]) -> list[Drop]:
    """Read the edges of all runs of a file.

    Accepts a byte order mark, any line ends, blank lines, comment lines (``#``) and spaces around
    values. Rows are in order of time within a run and channel; rows of several channels may come
    one channel after another.

    Parameters
    ----------
    path
        The CSV file.

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
    problems = ProblemList(str(path))
    table = _Table(problems)
    try:
        size = Path(path).stat().st_size
        if size > MAX_BYTES:
            problems.add(1, 1, "", f"{size / 1e6:.0f} MB is more than {MAX_BYTES / 1e6:.0f} MB")
            problems.raise_if_any("is it the right file? otherwise split it by runs")
        # Wrong bytes inside comments harm nobody; inside values they are reported as such.
        text = read_input(path).decode("utf-8-sig", "replace")
        for place, record in _records(Lines(io.StringIO(text, newline="")), problems):
            table.add(place, record)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if not table.runs:
        problems.add_if_none(1, 1, "", "no edges in this file")
    problems.raise_if_any()
    return [drop_of(run, edges) for run, edges in sorted(table.runs.items())]


def edges_text(drops: Iterable[Drop], rates: Mapping[int, float | Fraction] | None = None) -> str:
    """Write drops in the import format; `read_edges` gives the same edges back.

    Parameters
    ----------
    drops
        At most one a run: the format does not know of attempts.
    rates
        Calibrated tick rate by run, Hz; runs left out use their nominal rate.

    Raises
    ------
    ValueError
        If two drops are of the same run.
    """
    text = io.StringIO()
    text.write(",".join(HEADER) + "\n")
    seen: set[int] = set()
    for drop in drops:
        if drop.run in seen:
            raise ValueError(f"two drops of run {drop.run}")
        seen.add(drop.run)
        rate = Fraction((rates or {}).get(drop.run, drop.tick_hz))
        text.writelines(
            f"{drop.run},{edge.channel},{_seconds(edge.tick, rate)},{int(edge.blocked)}\n"
            for edge in drop.edges
        )
    return text.getvalue()


class _Table:
    """Checked rows by run, in picoseconds."""

    def __init__(self, problems: ProblemList) -> None:
        self.runs: defaultdict[int, list[Edge]] = defaultdict(list)
        self._problems = problems
        self._last: dict[tuple[int, int], int] = {}
        self._span: dict[int, tuple[int, int]] = {}

    def add(self, place: _Place, record: list[str]) -> None:
        run = place.whole(record, 0, 1, None, "runs count from 1")
        channel = place.whole(record, 1, 0, GATES - 1, f"channels are 0 to {GATES - 1}")
        time = place.time(record, 2)
        state = place.whole(record, 3, 0, 1, "1 is blocked, 0 is clear")
        if run is None or channel is None or time is None or state is None:
            return
        before = self._last.get((run, channel), time)
        if time < before:
            place.problem(
                2,
                f"{record[2]} is before {_seconds(before, Fraction(TICK_HZ))}, the last time of "
                f"channel {channel} in run {run}",
            )
            return
        low, high = self._span.get(run, (time, time))
        low, high = min(low, time), max(high, time)
        if high - low > MAX_SPAN_S * TICK_HZ:
            place.problem(2, f"run {run} would last more than an hour; times are in seconds")
            return
        self._last[run, channel] = time
        self._span[run] = low, high
        self.runs[run].append(Edge(time, channel, state == 1))


class _Place:
    """Where a record stands, and the reading of its values."""

    def __init__(self, lines: Lines, problems: ProblemList) -> None:
        self._lines = lines
        self._problems = problems

    def problem(self, field: int, message: str) -> None:
        """Note a fault of one value."""
        lines = self._lines
        self._problems.add(lines.number, lines.column(field), HEADER[field], message)

    def whole(
        self, record: list[str], field: int, least: int, most: int | None, rule: str
    ) -> int | None:
        """Read a whole number within limits."""
        text = record[field]
        if not _WHOLE.fullmatch(text):
            self.problem(field, f"{text!r:.40} is not a whole number; {rule}")
            return None
        value = int(text)
        if value < least or (most is not None and value > most):
            self.problem(field, f"{text} is out of range; {rule}")
            return None
        return value

    def time(self, record: list[str], field: int) -> int | None:
        """Read a time in seconds as picoseconds, ties to even."""
        text = record[field]
        ticks = picoseconds(text)
        if ticks is None:
            self.problem(field, f"{text!r:.40} is not a time in seconds")
        elif abs(ticks) >= 10**12 * TICK_HZ:
            self.problem(field, f"{text:.40} s is absurd")
            return None
        return ticks


def picoseconds(text: str, power: int = 0) -> int | None:
    """Read a decimal number of seconds, or of 10^power s, as picoseconds, ties to even.

    Returns
    -------
    int or None
        `None` for what is no such number.
    """
    match = _DECIMAL.fullmatch(text)
    if match is None or not (match[2] or match[3]):
        return None
    sign, whole, part, exponent = match.groups(default="")
    digits, shift = int(whole + part), int(exponent or 0) - len(part) + 12 + power
    ticks = digits * 10**shift if shift >= 0 else round(Fraction(digits, 10**-shift))
    return -ticks if sign == "-" else ticks


def _records(lines: Lines, problems: ProblemList) -> Iterator[tuple[_Place, list[str]]]:
    """Yield data rows of four stripped values; the header and rows of other shapes are checked."""
    place = _Place(lines, problems)
    reader = csv.reader(lines, strict=True)
    expected = ",".join(HEADER)
    headed = False
    while True:
        lines.start_record()
        try:
            record = [value.strip() for value in next(reader)]
        except StopIteration:
            return
        except csv.Error as error:
            problems.add(lines.number, 1, "", f"not CSV: {error}")
            record = []
        if lines.consumed > 1:
            problems.add(lines.number, 1, "", "a quoted value runs over the end of its line")
        elif not headed and record:
            if tuple(value.lower() for value in record) != HEADER:
                problems.add(lines.number, 1, "", f"the header must be {expected}")
                return  # the values of a file of another kind would only make noise
            headed = True
        elif record and len(record) != len(HEADER):
            problems.add(
                lines.number, 1, "", f"{len(record)} values where there must be 4: {expected}"
            )
        elif record:
            yield place, record


def drop_of(run: int, edges: list[Edge]) -> Drop:
    """Put the edges of a run in order, in picoseconds from the whole second before them."""
    edges.sort(key=lambda edge: edge.tick)  # stable: equal times stay as the file has them
    start = edges[0].tick // TICK_HZ * TICK_HZ
    first: dict[int, bool] = {}
    for edge in edges:
        first.setdefault(edge.channel, edge.blocked)
    return Drop(
        run=run,
        attempt=1,
        tick_hz=TICK_HZ,
        edges=tuple(edge._replace(tick=edge.tick - start) for edge in edges),
        initial_state=sum(1 << channel for channel, blocked in first.items() if not blocked),
    )


def _seconds(tick: int, rate: Fraction) -> str:
    """Write a time as a plain decimal, exact to the picosecond."""
    # In whole numbers: dividing Fractions costs ten times as much.
    ticks, ratio = 2 * tick * TICK_HZ * rate.denominator, rate.numerator
    picoseconds = (ticks + ratio) // (2 * ratio)
    whole, part = divmod(abs(picoseconds), TICK_HZ)
    sign = "-" if picoseconds < 0 else ""
    return f"{sign}{whole}.{part:012d}".rstrip("0").rstrip(".")
