"""Any other timer's file: what it is, the drops in it, and what had to be supposed.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps) and oscilloscopes (volts). What a
file does not say (which gate, which level is dark, what unit) is supposed where only one thing can
be meant, told, and else asked of the caller.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rig.reasons import make_reason
from rig.records import Edge
from rig.timers.columns import columns_of
from rig.timers.edges_csv import HEADER, TICK_HZ, drop_of
from rig.timers.passages import MAX_SPAN_S, PAUSE_S, PassageRows, split_at_pauses
from rig.timers.problems import ProblemList
from rig.timers.samples import (
    input_names,
    level_passages,
    sample_rate_hz,
    sample_times,
    volt_passages,
)
from rig.timers.table import is_number, lines_of, read_table, with_point
from rig.timers.vcd import is_vcd, read_vcd

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Mapping, Sequence

    from rig.reasons import Reason
    from rig.records import Drop
    from rig.timers.columns import Columns
    from rig.timers.passages import Passage
    from rig.timers.table import RowBlock, Table

MAX_COLUMNS = 200
_HINT = (
    "accepted are run,channel,time_s,state; tables with a heading such as time (s), gate, state; "
    "samples of inputs (0 and 1, or volts) with times; and value change dumps"
)
_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}


@dataclass(slots=True)
class TimerFile:
    """What was understood of a file.

    Attributes
    ----------
    kind
        In words.
    columns
        What each column was taken for, by its heading.
    runs
        Passages of each, by number.
    begins
        The level that each input begins with, where samples say.
    period_s
        Of samples: no edge is known better than that; `None` for stamps.
    notes
        What was assumed, a reason each.
    """

    kind: str
    columns: dict[str, str] = field(default_factory=dict)
    runs: dict[int, list[Passage]] = field(default_factory=dict)
    begins: dict[str, bool] = field(default_factory=dict)
    period_s: float | None = None
    notes: list[Reason] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {passage.label for run in self.runs.values() for passage in run} - {""}
        return tuple(sorted(labels, key=lambda label: (label_number(label) or 0, label)))

    def add(self, passages: list[Passage], number: int = 0) -> None:
        """Add a run, under its number or else the next one."""
        if number < 1 or number in self.runs:
            number = max(self.runs, default=0) + 1
        self.runs[number] = passages


def is_edge_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file has the heading of the project's own format, be it with faults."""
    lines = lines_of(path)
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    return first.lower().replace(" ", "").startswith(",".join(HEADER[:2]))


def read_timer_file(path: str | os.PathLike[str], unit: str | None = None) -> TimerFile:
    """Find out what a file says.

    Parameters
    ----------
    path
        The file.
    unit
        Of its times where it does not say: ``s``, ``ms``, ``us`` or ``ns``.

    Raises
    ------
    InputError
        Every fault of the file at its line and column.
    """
    problems = ProblemList(str(path), _HINT)
    lines = lines_of(path)
    if is_vcd(lines):
        passages, begins, scale = read_vcd(lines, problems)
        problems.raise_if_any()
        file = TimerFile("a value change dump", begins=begins, period_s=scale / TICK_HZ)
        if passages:
            file.add(passages)
    else:
        table = read_table(lines)
        if not table.blocks:
            problems.refuse(1, 1, "no_edges")
        file = _read_blocks(table, unit, problems)
    _split_drops(file, problems)
    problems.raise_if_any()
    if not file.runs:
        notes = "".join(f"; {note}" for note in file.notes)
        problems.refuse(1, 1, "nothing_passes", notes=notes)
    return file


def _read_blocks(table: Table, unit: str | None, problems: ProblemList) -> TimerFile:
    file = TimerFile(f"a table, its cells separated by {_SEPARATORS[table.separator]}")
    columns: Columns | None = None
    above = None
    for block in table.blocks:
        if not any(len(row.cells) > 1 or len(block.rows[0].cells) == 1 for row in block.headings):
            block.headings = [*(above.headings if above else ()), *block.headings]
        above = block
        width = len(block.rows[0].cells)
        if width > MAX_COLUMNS:
            line = block.rows[0].line
            problems.refuse(line, 1, "too_many_columns", columns=width, limit=MAX_COLUMNS)
        _named_inputs(block, table)
        columns = columns_of(block, table.separator, unit, problems)
        problems.raise_if_any()
        file.columns |= columns.meanings
        if columns.levels or columns.volts:
            _samples(file, block, columns, table, problems)
        else:
            rows = PassageRows(columns, table.separator, problems)
            for row in block.rows:
                rows.add(row)
            if rows.up_and_down:
                numbers = "these numbers go up and down: they"
                problems.refuse(block.rows[0].line, 1, "durations", numbers=numbers)
            if columns.derived and _is_sampled(rows.runs(), columns):
                unused = ", ".join(columns.unused)
                problems.refuse(block.rows[0].line, 1, "regular_samples", columns=unused)
            for number, passages in rows.runs():
                file.add(passages, number)
    assert columns is not None
    if columns.unused:
        file.notes.append(make_reason("columns_unused", columns=", ".join(columns.unused)))
    return file


def _is_sampled(runs: Sequence[tuple[int, list[Passage]]], columns: Columns) -> bool:
    """Whether all times are as far apart as in a recording at a fixed rate."""
    if columns.edge is not None or any(column.state is not None for column in columns.times):
        return False
    times = [[passage.tick for passage in run] for _, run in runs if run[4:]]
    steps = [step for ticks in times for step in np.diff(ticks).tolist()]
    return bool(steps) and max(steps) < 1.5 * min(steps)


def _named_inputs(block: RowBlock, table: Table) -> None:
    """Put the inputs' names that remarks list above columns of levels that have none."""
    names = input_names(table.remarks)
    width = len(block.rows[0].cells)
    rate = sample_rate_hz(table.remarks)
    bare = not block.headings or all(
        text.lower() in {"logic", "analog"} for text in block.headings[-1].texts
    )
    if rate is None or not bare:
        return
    row = block.rows[0]
    labels = names if len(names) == width else [f"D{n}" for n in range(width)]
    block.headings = [
        row._replace(cells=[c._replace(text=_input(name)) for c, name in zip(row.cells, labels,
                                                                            strict=True)])
    ]  # fmt: skip


def _input(name: str) -> str:
    """Write a name so that it reads as that of an input."""
    return name if label_number(name) is not None else f"input {name}"


def _samples(
    file: TimerFile, block: RowBlock, columns: Columns, table: Table, problems: ProblemList
) -> None:
    """Find the passages in samples."""
    rate = sample_rate_hz(table.remarks)
    if not columns.times and rate is None:
        problems.refuse(block.rows[0].line, 1, "no_rate", lacks="a column of times or a rate")
    times = sample_times(block.rows, columns, table.separator, rate, problems)
    problems.raise_if_any()
    steps = np.diff(np.array(times, dtype=float)) / TICK_HZ
    passages: list[Passage] = []
    if columns.levels:
        passages, begins = level_passages(block.rows, columns, times, problems)
        file.begins |= begins
        file.period_s = None if rate is None else 1.0 / rate
    for at, heading in columns.volts.items():
        volts = _volts(block, at, table.separator, problems)
        problems.raise_if_any()
        crossed = volt_passages(heading, times, volts)
        if crossed is None:
            low, high = float(volts.min()), float(volts.max())
            file.notes.append(make_reason("no_passage", input=heading, low=low, high=high))
            continue
        crossings, file.begins[heading], middle = crossed
        passages += crossings
        level = {"input": heading, "level": float(middle)}
        file.notes.append(make_reason("crossings", crossings=len(crossings), **level))
        file.period_s = float(np.median(steps)) if steps.size else None
    if passages:
        file.add(passages)


def _volts(
    block: RowBlock, at: int, separator: str, problems: ProblemList
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    values = np.zeros(len(block.rows))
    for n, row in enumerate(block.rows):
        cell = row.cell(at)
        if not is_number(cell.text, separator):
            problems.reject(row.line, cell.column, "volts", cell.text, "a number of volts")
            continue
        values[n] = float(with_point(cell.text, separator))
    return values


def _split_drops(file: TimerFile, problems: ProblemList) -> None:
    """Part drops that stand one after the other in one recording."""
    parts = [part for run in file.runs.values() for part in split_at_pauses(run)]
    if len(parts) > len(file.runs):
        file.notes.append(make_reason("several_drops", drops=len(parts), pause_s=PAUSE_S))
        file.runs = dict(enumerate(parts, 1))
    for number, run in file.runs.items():
        ticks = [passage.tick for passage in run]
        span = (max(ticks) - min(ticks)) / TICK_HZ
        if span > MAX_SPAN_S:
            values = {"recording": f"run {number}", "lasting_s": span, "limit_s": MAX_SPAN_S}
            problems.refuse(1, 1, "too_long", **values)


def drops_of(
    file: TimerFile, channels: Mapping[str, int], bars: int, dark: str | None = None
) -> list[Drop]:
    """Turn what was understood into drops.

    Parameters
    ----------
    file
        From `read_timer_file`.
    channels
        Of each label; of ``""`` where the file names no input.
    bars
        How many pass a gate: with no states given, more times than that are of darkening and
        clearing in turn, and as many or fewer of darkening alone.
    dark
        Which level is that of a blocked beam, ``high`` or ``low``; beams are taken to be clear at
        the beginning if not given.

    Returns
    -------
    list of Drop
        One a run, numbered from 1; as `rig.timers.edges_csv.read_edges` gives them.
    """
    high = _dark_is_high(file, dark)
    drops = []
    for number, run in sorted(file.runs.items()):
        edges: list[Edge] = []
        for label in dict.fromkeys(passage.label for passage in run):
            if label in channels:
                ours = [passage for passage in run if passage.label == label]
                edges += _edges(ours, channels[label], bars, high)
        if edges:
            drops.append(drop_of(number, edges))
    return drops


def _dark_is_high(file: TimerFile, dark: str | None) -> bool:
    """Whether a signal is high where the beam is blocked."""
    signals = [passage for run in file.runs.values() for passage in run if passage.high is not None]
    if not signals:
        return True
    if dark is None:
        if file.begins:
            moved = {passage.label for passage in signals}
            starts = [high for label, high in file.begins.items() if label in moved]
        else:  # edges: the first of a beam darkens it
            first = {
                (number, passage.label): passage.high
                for number, run in file.runs.items()
                for passage in sorted(run, key=lambda passage: -passage.tick)
            }
            starts = [high is False for high in first.values()]
        dark, opposite = ("low", "high") if sum(starts) * 2 > len(starts) else ("high", "low")
        file.notes.append(make_reason("blocked_level", level=dark, other=opposite))
    return dark == "high"


def _edges(run: Sequence[Passage], channel: int, bars: int, high: bool) -> Iterable[Edge]:
    both = len(run) > bars
    for n, passage in enumerate(run):
        if passage.blocked is not None:
            blocked = passage.blocked
        elif passage.high is not None:
            blocked = passage.high is high
        else:
            blocked = n % 2 == 0 if both else True
        yield Edge(passage.tick, channel, blocked)


def label_number(label: str) -> int | None:
    """The number in an input's name: 3 of D3, of ``Channel 3 (V)`` and of 3."""
    text = re.sub(r"[\[(].*", "", label).strip()
    match = re.search(r"([0-9]+)$", text)
    return int(match[1]) if match else None
