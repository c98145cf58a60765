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
from rig.files import read_input
from rig.records import Drop, Edge
from rig.timers.problems import Lines, ProblemList, refusal

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
    # Wrong bytes inside comments harm nobody; inside values they are reported as such.
    text = read_content(path, problems).decode("utf-8-sig", "replace")
    for place, record in _records(Lines(io.StringIO(text, newline="")), problems):
        table.add(place, record)
    problems.raise_if_any()
    if not table.runs:
        problems.refuse(1, 1, "no_edges")
    return [drop_of(run, edges) for run, edges in sorted(table.runs.items())]


def read_content(path: str | os.PathLike[str], problems: ProblemList) -> bytes:
    """Return the bytes of a file.

    Raises
    ------
    InputError
        A file that cannot be read, or is far too large.
    """
    try:
        size = Path(path).stat().st_size
        if size > MAX_BYTES:
            problems.refuse(1, 1, "too_large", size_mb=size / 1e6, limit_mb=MAX_BYTES / 1e6)
        return read_input(path)
    except OSError as error:
        raise refusal(str(path), "unreadable", text=error.strerror or str(error)) from error


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
        run = place.read_whole(record, 0, range(1, 10**9), "a run: a whole number from 1")
        channel = place.read_whole(record, 1, range(GATES), f"a channel: 0 to {GATES - 1}")
        time = place.read_time(record, 2)
        state = place.read_whole(record, 3, range(2), "a state: 1 is blocked, 0 is clear")
        if run is None or channel is None or time is None or state is None:
            return
        before = self._last.get((run, channel), time)
        if time < before:
            last = _seconds(before, Fraction(TICK_HZ))
            place.add(2, "before_last", text=record[2], last=last, channel=channel, run=run)
            return
        low, high = self._span.get(run, (time, time))
        low, high = min(low, time), max(high, time)
        if high - low > MAX_SPAN_S * TICK_HZ:
            lasting = (high - low) / TICK_HZ
            place.add(2, "too_long", recording=f"run {run}", lasting_s=lasting, limit_s=MAX_SPAN_S)
            return
        self._last[run, channel] = time
        self._span[run] = low, high
        self.runs[run].append(Edge(time, channel, state == 1))


class _Place:
    """Where a record stands, and the reading of its values."""

    def __init__(self, lines: Lines, problems: ProblemList) -> None:
        self._lines = lines
        self._problems = problems

    def add(self, field: int, code: str, **values: object) -> None:
        """Note a fault of one value."""
        lines = self._lines
        self._problems.add(lines.number, lines.column(field), HEADER[field], code, **values)

    def reject(self, field: int, text: str, accepted: str) -> None:
        """Note a value that is not what is accepted there."""
        self.add(field, "not_accepted", text=text, accepted=accepted)

    def read_whole(self, record: list[str], field: int, limits: range, accepted: str) -> int | None:
        """Read a whole number within limits."""
        text = record[field]
        if not _WHOLE.fullmatch(text) or int(text) not in limits:
            self.reject(field, text, accepted)
            return None
        return int(text)

    def read_time(self, record: list[str], field: int) -> int | None:
        """Read a time in seconds as picoseconds, ties to even."""
        text = record[field]
        ticks = picoseconds(text)
        if ticks is None or abs(ticks) >= 10**12 * TICK_HZ:
            self.reject(field, text, "a time of a drop in seconds")
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
    sign, integer, part, exponent = match.groups(default="")
    digits, shift = int(integer + part), int(exponent or 0) - len(part) + 12 + power
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
            problems.add(lines.number, 1, "", "not_csv", text=str(error))
            record = []
        if lines.consumed > 1:
            problems.add(lines.number, 1, "", "open_quote")
        elif not headed and record:
            if tuple(value.lower() for value in record) != HEADER:
                problems.add(lines.number, 1, "", "wrong_header", header=expected)
                return  # the values of a file of another kind would only make noise
            headed = True
        elif record and len(record) != len(HEADER):
            values = {"values": len(record), "needed": len(HEADER), "header": expected}
            problems.add(lines.number, 1, "", "wrong_width", **values)
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
    integer, part = divmod(abs(picoseconds), TICK_HZ)
    sign = "-" if picoseconds < 0 else ""
    return f"{sign}{integer}.{part:012d}".rstrip("0").rstrip(".")
