"""Any other timer's file: its passages, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps) and oscilloscopes (volts). What a
file does not say (which gate, which level is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rig.reasons import make_reason
from rig.timers.columns import columns_of
from rig.timers.edges_csv import HEADER, TICK_HZ
from rig.timers.passages import Group, RowReader, split_at_jumps
from rig.timers.problems import ProblemList
from rig.timers.samples import SampleReader, name_levels
from rig.timers.table import read_lines, read_table
from rig.timers.vcd import is_vcd, read_vcd
from rig.timers.vocabulary import number_of, recognise_format

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from rig.reasons import Reason
    from rig.timers.columns import TimerColumn
    from rig.timers.table import RowBlock, Table

MAX_COLUMNS = 200
_HINT = (
    "accepted are run,channel,time_s,state; tables with a heading such as time (s), gate, state; "
    "samples of inputs (0 and 1, or volts) with times; and value change dumps; see "
    "rig import --list-formats"
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
    groups
        Passages of each run, or of each gate where these stand one below the other.
    begins
        The level that each input begins with, where samples say.
    period_s
        Of samples: no edge is known better than that; `None` for stamps.
    has_unit
        Whether the file says the unit of its times; without it they are read as seconds.
    rows
        Numbers of the lines of data.
    silent
        Of them, those that only say that nothing changes: samples, and states as they were.
    notes
        What is to be said, a reason each.
    """

    kind: str
    columns: dict[str, str] = field(default_factory=dict)
    groups: list[Group] = field(default_factory=list)
    begins: dict[str, bool] = field(default_factory=dict)
    period_s: float | None = None
    has_unit: bool = True
    rows: list[int] = field(default_factory=list)
    silent: set[int] = field(default_factory=set)
    notes: list[Reason] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {passage.label for group in self.groups for passage in group.passages} - {""}
        return tuple(sorted(labels, key=lambda label: (number_of(label) or 0, label)))


def is_edge_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file has the heading of the project's own format, be it with faults."""
    lines = read_lines(path)
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    return first[:200].lower().replace(" ", "").startswith(",".join(HEADER[:2]))


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
    lines = read_lines(path)
    if is_vcd(lines):
        passages, begins, scale = read_vcd(lines, problems)
        problems.raise_if_any()
        file = TimerFile("a value change dump", begins=begins, period_s=scale / TICK_HZ)
        file.groups = [Group(passages=passages)]
        file.rows = sorted({passage.line for passage in passages})
    else:
        table = read_table(lines)
        if not table.blocks:
            problems.refuse(1, 1, "no_edges")
        name = recognise_format(lines)
        file = TimerFile(
            f"a table, its cells separated by {_SEPARATORS[table.separator]}"
            + (f"; it looks like {name}" if name else "")
        )
        _read_blocks(file, table, unit, problems)
    problems.raise_if_any()
    file.groups = [group for group in file.groups if group.passages]
    if not file.groups:
        notes = "".join(f"; {note}" for note in file.notes)
        problems.refuse(1, 1, "nothing_passes", notes=notes)
    return file


def _read_blocks(file: TimerFile, table: Table, unit: str | None, problems: ProblemList) -> None:
    above: RowBlock | None = None
    for block in table.blocks:
        width = max(len(table.row(line).texts) for line in block.rows[:50])
        if width > MAX_COLUMNS:
            line = block.rows[0]
            problems.refuse(line, 1, "too_many_columns", columns=width, limit=MAX_COLUMNS)
        own = block.headings
        if not any(len(row.texts) > 1 or width == 1 for row in own) or (
            above is not None and not any(len(row.texts) == width for row in own)
        ):
            block.headings = [*own, *(above.headings if above else ())]
        above = block
        block.headings += name_levels(block, table)
        columns = columns_of(block, table, unit, problems)
        problems.raise_if_any()
        file.columns |= {column.name: column.meaning for column in columns}
        roles = {column.role for column in columns}
        file.has_unit &= all(column.power is not None for column in columns)
        file.rows += block.rows
        if roles & {"level", "volts"}:
            _add_samples(file, SampleReader(block, columns, table, problems), block)
        elif "time" in roles:
            _add_rows(file, block, columns, table, problems)
        else:
            durations = [repr(column.name) for column in columns if column.role == "duration"]
            heading = block.headings[0].line if block.headings else block.rows[0]
            code = "durations" if durations else "no_time_column"
            problems.refuse(heading, 1, code, numbers=", ".join(durations))
    file.rows = sorted([*file.rows, *table.strays])


def _add_rows(
    file: TimerFile,
    block: RowBlock,
    columns: Sequence[TimerColumn],
    table: Table,
    problems: ProblemList,
) -> None:
    reader = RowReader(block, columns, table, problems)
    problems.raise_if_any()
    file.silent |= reader.silent
    stated = {"edge", "state", "gate", "run"} & {column.role for column in columns}
    for group in reader.groups.values():
        lines = [passage.line for passage in group.passages]
        if len(set(lines)) == 1:  # columns of a row may stand in any order
            group.passages.sort(key=lambda passage: passage.tick)
        parts = split_at_jumps(group, in_order=len(set(lines)) == len(lines))
        ticks = [passage.tick for passage in group.passages]
        backwards = sum(b < a for a, b in itertools.pairwise(ticks))
        if not stated and backwards > 1 and backwards * 4 > len(ticks):
            numbers = "these numbers go up and down: they"
            problems.refuse(block.rows[0], 1, "durations", numbers=numbers)
        short = next((p for p in parts[1:] if len(p.passages) < 2), parts[-1])
        if len(parts) > 1 and (len(short.passages) < 2 or len(parts[0].passages) < 2):
            line = (short if short is not parts[0] else parts[1]).passages[0].line
            at = next(column.at for column in columns if column.role == "time")
            text = table.row(line).cell(at)
            problems.add(line, table.column(line, at), "time", "backwards", text=text)
        derived = [column.name for column in columns if column.role == "other"]
        steps = [b - a for a, b in itertools.pairwise(ticks)]
        if derived and not stated and len(steps) > 3 and max(steps) < 1.5 * min(steps):
            problems.refuse(block.rows[0], 1, "regular_samples", columns=", ".join(derived))
        mark = " ".join(block.headings[0].texts) if block.headings and not group.name else ""
        for part in parts:
            part.name = part.name or mark
        file.groups += parts
    unused = [column.name for column in columns if column.role in {"other", "duration"}]
    if unused:
        file.notes.append(make_reason("columns_unused", columns=", ".join(unused)))


def _add_samples(file: TimerFile, reader: SampleReader, block: RowBlock) -> None:
    file.groups.append(Group(passages=reader.passages))
    file.silent |= set(block.rows)
    file.begins |= reader.begins
    file.period_s = reader.step_s or None
    file.notes += reader.notes
