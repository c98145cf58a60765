"""Events of a timer's file: when, at which input, and what the beam or signal did."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from rig.reasons import Reason, make_reason
from rig.timers.problems import ProblemList
from rig.timers.vocabulary import number_of


class TimerEvent(NamedTuple):
    """One change at one input.

    Attributes
    ----------
    tick
        In picoseconds.
    label
        What the file calls the input; empty where it does not say.
    state
        What begins with it: ``blocked`` or ``clear``; ``high`` or ``low`` where only the signal is
        known; empty where the file does not say.
    line
        Of the file.
    run, part
        What the file calls the run, and the part that the event stands in: how many came before it.
    """

    tick: int
    label: str
    state: str = ""
    line: int = 0
    run: str = ""
    part: int = 0


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
    events
        All of them.
    open_parts
        Which part the next row may continue, and the latest time there of each input and of all,
        by the run and the column of times.
    period
        Of samples that are all as far apart, so that a row may have several changes: no edge is
        known better than that, ps; `None` for others.
    has_unit
        Whether it says the unit of its times; those without are kept as if they were seconds.
    is_sampled
        Whether it has samples: a level that changes may be of an input that is no gate.
    is_counted
        Whether inputs without a heading are called by their place, which says nothing of gates.
    is_wide
        Whether a row has several times, so that it may be a run.
    first
        Of a log of changes: that which its first row is, unless it says the state at the beginning.
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
    events: list[TimerEvent] = field(default_factory=list)
    open_parts: dict[tuple[str, int], tuple[int, dict[str, int], int]] = field(default_factory=dict)
    period: int | None = None
    has_unit: bool = True
    is_sampled: bool = False
    is_counted: bool = False
    is_wide: bool = False
    first: TimerEvent | None = None
    rows: int = 0
    unread: list[int] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)
    problems: ProblemList = field(init=False)

    def __post_init__(self) -> None:
        """Begin without faults."""
        self.problems = ProblemList(str(self.path), make_reason("timer_files").text)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls its inputs, in order; none where it does not say."""
        labels = {event.label for event in self.events} - {""}
        return tuple(sorted(labels, key=lambda label: (number_of(label) or 0, label)))
