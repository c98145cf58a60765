"""What was understood of a timer's file: its changes, and what it leaves open.

What a file does not say (which gate, which level is dark, which unit) is left to
`rig.timers.layouts`.
"""

import itertools
from collections import defaultdict
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from rig.reasons import Reason, make_reason
from rig.timers.problems import ProblemList
from rig.timers.vocabulary import number_of

STATES = ("", "clear", "blocked", "low", "high")
"""What begins with a change, of a beam or of a signal, in turns clear and blocked, or low and high;
nothing where the file does not say."""


CHANGE = np.dtype("i4,O,i1,i4,i4,i4,i4,?")
CHANGE.names = "line", "tick", "state", "run", "label", "clock", "block", "first"
"""A change at an input: its line; its time, ps (of a date it needs more than 64 bits); which of
`STATES` begins; what the file calls the run and the input (places in `TimerFile.names`); which
column of times it is of, where several are alike; the block of rows; and whether it is a first row,
which may say the state at the beginning."""
Records: TypeAlias = Any
"""Rows with named fields, a record array."""


class TimerFile:
    """What was understood of a file.

    Parameters
    ----------
    way
        Number, from 0, of the way of reading what it leaves open.

    Attributes
    ----------
    path
        Where it is.
    ways
        How many ways there are of reading it, as far as questions came up.
    lines
        In words: what kind of file, and what each column was taken for.
    names
        Places of the names of inputs and runs, the empty one first; a new name has the next.
    changes
        All of them, in the order of the lines.
    period
        Of samples that are all as far apart, so that a row may have several changes: no edge is
        known better than that, ps; `None` for others.
    powers
        Of its times, from seconds; `None` where it does not say the unit of some, which are kept as
        if they were seconds.
    facts
        What holds of it: ``sampled``, it has samples, and a level that changes may be of an input
        that is no gate; ``wide``, a row has several times that are called alike, so that each may
        be of a run; ``thousands``, a mark that may be that of decimals is taken to part thousands;
        ``guess``, rows lack the name of their run or gate, so that falls decide; ``run`` and
        ``gate``, rows say them, and a run may go on in another block.
    rows, last_row
        How many lines of data there are, and the number of the last.
    unread
        Those that neither change anything nor say that nothing changes.
    notes
        What is to be said, a reason each.
    stated
        What options decide: attributes of `rig.timers.layouts.FileLayout`.
    problems
        Its faults.
    """

    def __init__(self, path: str | Path, way: int = 0) -> None:
        self.path, self._rest, self.ways = path, way, 1
        self.names = defaultdict[str, int](itertools.count(1).__next__, {"": 0})
        self.changes: Records = np.recarray(0, CHANGE)
        self.period: int | None = None
        self.powers = set[int | None]()
        self.facts = set[str]()
        self.rows = self.last_row = 0
        self.unread, self.lines, self.notes = list[int](), list[str](), list[Reason]()
        self.stated = dict[str, Any]()
        self.problems = ProblemList(str(path), make_reason("timer_files").text)

    def choose(self, *answers: Any) -> Any:
        """Return which answer is tried to a question that the file leaves open.

        In the first way it is the first, the most usual.
        """
        self.ways *= len(answers)
        self._rest, n = divmod(self._rest, len(answers))
        return answers[n]

    @property
    def labels(self) -> list[str]:
        """What the file calls inputs that change, in order; none where it does not say."""
        names, places = [*self.names], {*self.changes.label[~self.changes.first].tolist()} - {0}
        return sorted((names[x] for x in places), key=lambda label: (number_of(label) or 0, label))
