"""Edges from any timer as CSV: ``run,channel,time_s,state``, state 1 = beam blocked.

Times are read as decimals and kept to the picosecond, so what a file says is what is analysed.
"""

from __future__ import annotations

import io
import re
from collections import defaultdict
from fractions import Fraction
from typing import TYPE_CHECKING

from rig.boards import GATES
from rig.records import Drop, Edge
from rig.timers.problems import ProblemList
from rig.timers.table import Table, read_content

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Mapping

HEADER = ("run", "channel", "time_s", "state")
TICK_HZ = 10**12
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
    # Wrong bytes inside comments harm nobody; inside values they are reported as such.
    text = read_content(path, problems).decode("utf-8-sig", "replace")
    table = Table(text.splitlines(), ",")
    reader = _RunReader(table, problems)
    _read_rows(table, reader, problems)
    problems.raise_if_any()
    if not reader.runs:
        problems.refuse(1, 1, "no_edges")
    return [drop_of(run, edges) for run, edges in sorted(reader.runs.items())]


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


class _RunReader:
    """Checks rows, and keeps them by run, in picoseconds."""

    def __init__(self, table: Table, problems: ProblemList) -> None:
        self.runs: defaultdict[int, list[Edge]] = defaultdict(list)
        self._table, self._problems = table, problems
        self._last: dict[tuple[int, int], int] = {}
        self._span: dict[int, tuple[int, int]] = {}

    def add(self, line: int, texts: list[str]) -> None:
        """Read a row of four values."""
        run = self._read_whole(line, texts, 0, range(1, 10**9), "a run: a whole number from 1")
        channels = range(GATES)
        channel = self._read_whole(line, texts, 1, channels, f"a channel: 0 to {GATES - 1}")
        time = picoseconds(texts[2])
        if time is None or abs(time) >= 10**12 * TICK_HZ:
            accepted = "a time of a drop in seconds"
            self._note(line, 2, "not_accepted", text=texts[2], accepted=accepted)
            time = None
        state = self._read_whole(line, texts, 3, range(2), "a state: 1 is blocked, 0 is clear")
        if run is None or channel is None or time is None or state is None:
            return
        before = self._last.get((run, channel), time)
        if time < before:
            last = _seconds(before, Fraction(TICK_HZ))
            values = {"text": texts[2], "last": last, "channel": channel, "run": run}
            self._note(line, 2, "before_last", **values)
            return
        low, high = self._span.get(run, (time, time))
        low, high = min(low, time), max(high, time)
        if high - low > MAX_SPAN_S * TICK_HZ:
            values = {"recording": f"run {run}", "lasting_s": (high - low) / TICK_HZ}
            self._note(line, 2, "too_long", **values, limit_s=MAX_SPAN_S)
            return
        self._last[run, channel] = time
        self._span[run] = low, high
        self.runs[run].append(Edge(time, channel, state == 1))

    def _note(self, line: int, at: int, code: str, **values: object) -> None:
        self._problems.add(line, self._table.column(line, at), HEADER[at], code, **values)

    def _read_whole(
        self, line: int, texts: list[str], at: int, limits: range, accepted: str
    ) -> int | None:
        if _WHOLE.fullmatch(texts[at]) and int(texts[at]) in limits:
            return int(texts[at])
        self._note(line, at, "not_accepted", text=texts[at], accepted=accepted)
        return None


def _read_rows(table: Table, reader: _RunReader, problems: ProblemList) -> None:
    """Read the rows below the header; those of other shapes are noted."""
    header, headed, quoted = ",".join(HEADER), False, False
    for line, text in enumerate(table.lines, 1):
        if not quoted and (not text.strip() or text.lstrip().startswith("#")):
            continue
        if text.count('"') % 2:
            quoted = not quoted
            if quoted:
                problems.add(line, 1, "", "open_quote")
            continue
        texts = table.row(line).texts
        if quoted:
            continue
        if not headed:
            if tuple(value.lower() for value in texts) != HEADER:
                problems.add(line, 1, "", "wrong_header", header=header)
                return  # the values of a file of another kind would only make noise
            headed = True
        elif len(texts) != len(HEADER):
            problems.add(
                line, 1, "", "wrong_width", values=len(texts), needed=len(HEADER), header=header
            )
        else:
            reader.add(line, texts)


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
