"""A timer's file: its changes, and what it leaves open.

Loggers of photogates (tables of times, or of times and states), boards that print pin, edge and
time, logic analysers (a column an input, or value change dumps) and oscilloscopes (volts). What a
file does not say (which gate, which level is dark, which unit) is left to `rig.timers.layouts`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path

import numpy as np

from rig.reasons import Reason, make_reason
from rig.timers.lines import is_cut, read_lines
from rig.timers.problems import ProblemList
from rig.timers.signals import CHANGE, Changes, SignalReader
from rig.timers.table import Row, Table
from rig.timers.vcd import BEGINNINGS, vcd_rows
from rig.timers.vocabulary import number_of

_SAMPLE = 200
"""Rows that show what columns are."""
_MARKS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "blanks", "": "words"}


@dataclass(eq=False, slots=True)
class TimerFile:
    """What was understood of a file.

    Attributes
    ----------
    path
        Where it is.
    way, ways
        In which way, from 0, its columns are understood, and how many there are.
    lines
        In words: what kind of file, and what each column was taken for.
    names
        Places of the names of inputs and runs, the empty one first.
    changes
        All of them, in the order of the lines.
    period
        Of samples that are all as far apart, so that a row may have several changes: no edge is
        known better than that, ps; `None` for others.
    has_unit
        Whether it says the unit of its times; those without are kept as if they were seconds.
    is_sampled
        Whether it has samples: a level that changes may be of an input that is no gate.
    is_wide
        Whether a row has several times, so that it may be a run.
    is_guess
        Whether rows lack the name of their run or gate, so that falls decide.
    has_runs
        Whether rows say their run, which may go on in another block.
    rows
        How many lines of data there are.
    unread
        Those that neither change anything nor say that nothing changes.
    notes
        What is to be said, a reason each.
    problems
        Its faults.
    """

    path: str | Path
    way: int = 0
    ways: int = 1
    lines: list[str] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=lambda: {"": 0})
    changes: Changes = field(default_factory=lambda: np.empty(0, CHANGE))
    period: int | None = None
    has_unit: bool = True
    is_sampled: bool = False
    is_wide: bool = False
    is_guess: bool = False
    has_runs: bool = False
    rows: int = 0
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)
    problems: ProblemList = field(init=False)

    def __post_init__(self) -> None:
        """Begin without faults."""
        self.problems = ProblemList(str(self.path), make_reason("timer_files").text)

    @property
    def is_stacked(self) -> bool:
        """Whether runs may stand one below the other; they part where times begin anew."""
        return not (self.is_sampled or self.has_runs)

    @property
    def labels(self) -> list[str]:
        """What the file calls inputs that change, in order; none where it does not say."""
        names, changes = [*self.names], self.changes[~self.changes["first"]]
        labels = [names[label] for label in np.unique(changes["label"]) if label]
        return sorted(labels, key=lambda label: (number_of(label) or 0, label))


def read_file(file: TimerFile) -> TimerFile:
    """Find out what a file says, in the way in which its columns are to be understood.

    Raises
    ------
    InputError
        Every fault of the file at its line and column, or what it is instead.
    """
    with closing(read_lines(file.path)) as lines:
        head = list(itertools.islice(lines, 50))
        numbered = enumerate(itertools.chain(head, lines), 1)
        is_dump = "".join(head).lstrip().startswith(BEGINNINGS)
        table = Table(vcd_rows(numbered, file.problems) if is_dump else numbered)
        file.lines.append(f"a table, its cells separated by {_MARKS[table.separator]}")
        readers: dict[object, SignalReader] = {}
        changes = [file.changes]
        for _, rows in itertools.groupby(table.rows(), attrgetter("block.key")):
            changes += _read_rows(file, rows, readers)
            file.problems.raise_if_any()
    file.changes = np.concatenate(changes)
    file.changes = file.changes[np.argsort(file.changes["line"], kind="stable")]
    _, file.changes["rank"] = np.unique(file.changes["tick"], return_inverse=True)
    file.rows += len(table.strays)
    file.unread += [row.line for row in table.strays]
    if not len(file.changes):
        notes = "".join(f"; {note}" for note in file.notes)
        file.problems.refuse(1, 1, "nothing_passes" if file.rows else "no_edges", notes=notes)
    file.notes += [make_reason("last_line_cut")] if is_cut(file.path) else []
    return file


def _read_rows(
    file: TimerFile, rows: Iterator[Row], readers: dict[object, SignalReader]
) -> Iterator[Changes]:
    """Yield what rows say whose columns are the same, and those of earlier ones with their key."""
    sample = list(itertools.islice(rows, _SAMPLE))
    block = sample[0].block
    if block.key not in readers:
        readers[block.key] = SignalReader(file, [row for row in sample if row.block is block])
    for _, capture in itertools.groupby(itertools.chain(sample, rows), attrgetter("block.number")):
        yield from readers[block.key].read(capture)
