"""Ways in which a file may be read: all of them, and the drops as each gives them.

A layout says what a file leaves open: the unit, which level is dark, whether parts are runs or
gates, and which gate each input is. What each setting may be, and when, is in `layouts.txt`.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from rig.arrays import Flags, Index
from rig.records import Drop
from rig.text_rows import read_rows
from rig.timers.edge_rows import make_drop
from rig.timers.moments import TICK_HZ
from rig.timers.timer_file import STATES, Records, TimerFile
from rig.timers.vocabulary import POWERS, facts_held, holds, number_of

_CLEAR_PAUSE = 3.0
_GOOD = 0.75
"""Share of the edges that makes a reading credible."""
_GOOD_GUESS = 0.95
"""The same where falls decide which columns, or which gates, rows are of."""
_MOST_MAPS = 200
_FEWEST = 3
"""Changes of a drop that tell which gate it passed: two are near those of falls past several."""


class FileLayout(NamedTuple):
    """What a file leaves open.

    Attributes
    ----------
    unit
        Of the times; empty where the file says it.
    dark
        Which level is that of a blocked beam, ``high`` or ``low``; ``states`` where the file says
        when a beam is blocked, ``inverted`` where it says the contrary; of times alone, whether the
        beam darkens and clears in turns, clears first (``turns-clear``), or darkens at ``each``.
    groups
        Whether parts of the file are ``runs``, and parted where times begin anew; or such parts
        have times in any order (``unsorted``); or runs are its ``columns`` of times; or in each run
        all gates stand in the order of the way (``passing``). Runs that are its ``rows``, though
        their times do not begin anew, have to be stated.
    first
        Whether the first row of a log of changes is the ``state`` at the beginning or a ``change``.
    pause_s
        Beyond which a pause parts two runs; 0 for none.
    channels
        Of each input; of the empty text where the file names none.
    """

    unit: str = ""
    dark: str = "states"
    groups: str = "runs"
    first: str = "state"
    pause_s: float = 0.0
    channels: Mapping[str, int] = MappingProxyType({})

    @property
    def text(self) -> str:
        """What ``--map`` accepts."""
        settings = zip(SETTINGS, self, FileLayout(), strict=False)
        pairs = [f"{name}={value}" for name, value, usual in settings if value != usual]
        return ",".join([*pairs, *(f"{x or 'input'}={n}" for x, n in self.channels.items())])

    def __str__(self) -> str:
        return f"--map '{self.text}'"


SETTINGS = {
    name: "|".join(row[1] for row in read_rows(__file__) if row[0] == name)
    for name in FileLayout._fields[:-1]
}
"""What a layout has beside its inputs; `layouts.txt` says what each may be."""


class FileReading:
    """Edges as a layout of a file gives them, run by run; runs without a number have a free one.

    Attributes
    ----------
    edges
        All of them, by runs: of each its run, its time, ps, its gate, the state after it, and the
        line that it comes from.
    runs, lasting, longest
        Those of each run, by its number, and how long they last, ps; the longest of them.
    firsts
        Inputs whose first row is a beam that is blocked, at the beginning or by a change.
    states
        Lines that only say that beams are clear: what passed no beam is no drop.
    renamed
        Runs that the file calls otherwise: its name, and the number here.
    """

    def __init__(self, file: TimerFile, layout: FileLayout) -> None:
        self.file, self.layout = file, layout
        changes, drop = group_changes(file, layout.unit, layout.groups, layout.pause_s)
        label, names = changes.label, [*file.names]
        channels = [layout.channels.get(name, -1) for name in names]
        begin = np.searchsorted(drop, drop)
        if layout.groups == "passing":  # of gates that are passed one by one, each has as many
            channels = [*layout.channels.values()]
            share = np.maximum(1, np.bincount(drop)[drop] // len(channels))
            label = np.minimum((np.arange(len(drop)) - begin) // share, len(channels) - 1)
        channel, state = np.array(channels)[label], changes.state
        is_turn = count_before(drop * (1 + len(channels)) + label) % 2 == 0
        blocked = np.where(
            state > 0,
            (state % 2 == 0) ^ (layout.dark in {"inverted", "low"}),
            is_turn ^ (layout.dark == "turns-clear") | (layout.dark == "each"),
        )
        # A beam is clear at the beginning; a first row that says so changes nothing.
        is_late, is_gate = changes.tick > changes.tick[begin], channel >= 0
        is_dark_first = changes.first & blocked & is_gate & ~is_late
        self.firsts = [names[n] for n in np.unique(changes.label[is_dark_first])]
        is_edge = is_gate & (~changes.first | (blocked & (is_late | (layout.first == "change"))))
        # Before a drop, a file may say that its beams are clear.
        is_said = drop < next(iter(drop[is_edge & blocked]), 0)
        is_edge &= ~is_said
        self.states = changes.line[is_said & is_gate].tolist()
        edges = np.rec.fromarrays(
            [drop, changes.tick, channel, blocked, changes.line, changes.clock],
            formats="i8,O,i8,?,i4,i4",
            names="run,tick,channel,blocked,line,clock",
        )[is_edge]
        _, begin, places = np.unique(edges.run, return_index=True, return_inverse=True)
        called = [names[n] for n in changes.run[is_edge][begin]]
        numbers = _number_runs([*map(number_of, called)])
        rows = zip(called, numbers, strict=True)
        self.renamed = {x or "one without a name": n for x, n in rows if number_of(x) != n}
        edges.run = np.array(numbers, int)[places]
        self.edges = edges[edges.run.argsort(kind="stable")]
        self.runs = {n: self.edges[self.edges.run == n] for n in sorted(numbers)}
        self.lasting = {n: part.tick[-1] - part.tick[0] for n, part in self.runs.items()}
        self.longest = max(self.lasting.values(), default=0)

    def drop(self, run: int) -> Drop:
        """Return the drop of a run."""
        return make_drop(run, self.runs[run][["tick", "channel", "blocked"]].tolist())

    @property
    def least_share(self) -> float:
        """Share of the edges near a fall's, of all that came or were due, that is credible."""
        facts = {*self.file.facts, self.layout.dark, self.layout.groups}
        is_guess = facts & {"guess", "inverted", "passing", "unsorted"}
        return _GOOD_GUESS if is_guess or not self.is_whole else _GOOD

    @property
    def oddities(self) -> int:
        """Count what is contrary to what the file says, or to how files and beams usually are."""
        odd = [x for x in read_rows(__file__) if x[3:] and getattr(self.layout, x[0]) == x[1]]
        return len(odd) + (not self.is_whole) + ("thousands" in self.file.facts)

    @property
    def is_whole(self) -> bool:
        """Whether beams are clear at the beginning, and in the end, as a protocol has them.

        Where the file says when they are, rows may be missing, but none says the contrary.
        """
        beams = self.edges.run * 100 + self.edges.channel
        _, first, counts = np.unique(beams, return_index=True, return_counts=True)
        is_odd = counts % 2 > 0
        is_turn = self.layout.dark.startswith("turns")
        return not np.any(is_odd if is_turn else ~self.edges.blocked[first] & ~is_odd)


def _number_runs(numbers: Sequence[int | None]) -> list[int]:
    """Number runs from 1, as the file does where it does so, and the others by free numbers."""
    shift = 0 in numbers  # a file may count its runs from 0
    first = {number: n for n, number in reversed([*enumerate(numbers)])}
    free = (n for n in itertools.count(1) if n - shift not in first)
    return [
        next(free) if number is None or number + shift < 1 or first[number] < n else number + shift
        for n, number in enumerate(numbers)
    ]


@lru_cache(4)
def group_changes(file: TimerFile, unit: str, groups: str, pause: float) -> tuple[Records, Index]:
    """Return changes by drops and times, and which drop each is of.

    In a file that says the drops, they are parted by no time; in others where times begin anew.
    """
    changes, tick = file.changes, file.changes.tick
    part = changes[{"rows": "line", "columns": "clock"}.get(groups, "run")]
    keys = np.stack([changes.block * ("run" not in file.facts), changes.run, part])
    order = np.lexsort((tick, changes.line, *keys[::-1]))
    is_new = _differs(*keys[:, order])
    if groups in {"runs", "passing"} and file.facts.isdisjoint({"sampled", "run"}):
        # Runs may stand one below the other.
        is_new |= np.diff(tick[order], prepend=0) < 0
    drop = np.cumsum(is_new) - 1
    order = order[np.lexsort((tick[order], drop))]
    # Nothing does the same twice at once.
    is_other = _differs(drop, *(changes[name][order] for name in ("tick", "label", "state")))
    changes, drops = changes[order][is_other], drop[is_other]
    changes.tick //= 10 ** POWERS[unit or "s"]
    if pause:
        is_late = np.diff(changes.tick, prepend=0) >= round(pause * TICK_HZ)
        drops += np.cumsum(is_late & ~_differs(drops))
    return changes, drops


def _differs(*columns: Index) -> Flags:
    """Return which rows differ from the one above."""
    differs: Flags = np.any([np.diff(x, prepend=-1) != 0 for x in columns], axis=0)
    return differs


def count_before(keys: Index) -> Index:
    """Return for each key how many equal ones are before it."""
    order = np.argsort(keys, kind="stable")
    before = np.empty_like(order)
    before[order] = np.arange(len(order)) - np.searchsorted(keys[order], keys[order])
    return before


def input_names(file: TimerFile, groups: str | None, gates: Sequence[int]) -> list[str]:
    """Name the inputs of a file whose parts are grouped so; an empty text where it names none."""
    passing = [f"gate {n}" for n in range(1, len(gates) + 1)]
    return passing if groups == "passing" else [*file.labels] or [""]


def find_layouts(file: TimerFile, gates: Sequence[int], bars: int) -> Iterator[FileLayout]:
    """Yield every way in which a file may be read, that which is most usual first.

    Parameters
    ----------
    gates
        Channels, in the order in which the gates are passed.
    """
    stated, state = file.stated, file.changes.state
    changes, drop = group_changes(file, "", "runs", 0.0)
    most = int(1 + count_before(drop * len(file.names) + changes.label).max(initial=0))
    kind = "signal" if np.any(state > STATES.index("blocked")) else "states"
    held = {
        kind if np.any(state) else "times": True,
        "many": most > bars,
        "wire": not file.labels and bars == 1 < len(gates),
        "open": None in file.powers,
        "first": np.any(file.changes.first),
    }
    facts = file.facts | facts_held(held)
    choices = dict[str, list[Any]]()
    for name, value, rule, *_ in read_rows(__file__):
        if holds(rule, facts):
            choices.setdefault(name, []).append(value)
    choices |= {name: [value] for name, value in stated.items() if name in choices}
    for values in itertools.product(*choices.values()):
        layout = FileLayout(**dict(zip(choices, values, strict=True)))
        pauses = _pauses(file, layout.unit, layout.groups)
        for pause in [float(stated["pause_s"])] if "pause_s" in stated else pauses:
            paused = layout._replace(pause_s=pause)
            maps = [stated["channels"]] if "channels" in stated else _channels(file, gates, paused)
            yield from (paused._replace(channels=channels) for channels in maps)


@lru_cache(4)
def _pauses(file: TimerFile, unit: str, groups: str) -> list[float]:
    """Return the pause, s, at which drops one after the other are parted, if there may be any.

    Between drops nothing passes for far longer than within one: of the pauses in order, the first
    of half a second or more that is three times as long as the one before.
    """
    changes, drop = group_changes(file, unit, groups, 0.0)
    pauses = np.sort(np.diff(changes.tick)[(np.diff(drop) == 0) & ("run" not in file.facts)])
    is_clear = pauses[1:] >= np.maximum(_CLEAR_PAUSE * pauses[:-1], TICK_HZ / 2)
    return [0.0, *(pauses[1:][is_clear] / TICK_HZ).tolist()[:1]]


def _channels(file: TimerFile, gates: Sequence[int], layout: FileLayout) -> list[dict[str, int]]:
    """Return which gate each input may be: by its number, in their order, or in that of passages.

    Inputs may be numbered from another number than channels, or have letters.
    """
    labels = input_names(file, layout.groups, gates)
    if layout.groups == "passing":
        return [dict(zip(labels, gates, strict=True))]
    by_number = {x: n for x in labels if (n := number_of(x)) is not None and n in gates}
    if len({*by_number.values()}) == len(labels):
        from_1 = {x: n - 1 for x, n in by_number.items() if n - 1 in gates}
        return [by_number, *[from_1] * (len(from_1) == len(labels))]
    _, drop = group_changes(file, layout.unit, layout.groups, layout.pause_s)
    if labels == [""] and len(gates) > 1 and np.all(np.bincount(drop) < _FEWEST):
        return []
    later = file.changes[~file.changes.first][::-1]
    first = dict(zip(later.label.tolist(), later.tick, strict=True))
    passed = sorted(labels, key=lambda label: first.get(file.names[label], 0))
    maps = [
        dict(zip(names, channels, strict=True))
        for beams in itertools.islice(itertools.combinations(gates, len(labels)), _MOST_MAPS)
        for names, channels in ((labels, sorted(beams)), (passed, beams))
    ]
    return maps or [by_number] * (0 < len(by_number) == len({*by_number.values()}))
