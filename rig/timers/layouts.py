"""Ways in which a file may be read: all of them, and the drops as each gives them.

A layout says what a file leaves open: the unit, which level is dark, whether parts are runs or
gates, and which gate each input is.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.records import Drop, Edge
from rig.timers.edge_rows import make_drop
from rig.timers.moments import LONGEST_S, TICK_HZ
from rig.timers.vocabulary import POWERS, number_of

if TYPE_CHECKING:
    from rig.timers.events import TimerEvent, TimerFile

_LONGEST_S = 60
"""A drop lasts half a second, and nobody waits a minute until it is recorded."""
_CLEAR_PAUSE = 3.0
_MOST_MAPS = 200

SETTINGS = ("unit", "dark", "groups", "first", "pause_s")
"""What a layout has beside its inputs; `forms.txt` says what each may be."""


@dataclass(frozen=True, slots=True)
class FileLayout:
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
        Whether parts of the file are ``runs``, or its ``rows`` are, or in each run all gates stand
        in the order of the way (``passing``).
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
    channels: Mapping[str, int] = field(default_factory=dict)

    def is_dark(self, event: TimerEvent, n: int) -> bool:
        """Whether an event, the n-th of its input, begins a blocked beam."""
        if event.state:
            return (event.state in {"blocked", "high"}) is (self.dark not in {"inverted", "low"})
        return self.dark == "each" or (n % 2 == 0) is (self.dark != "turns-clear")

    @property
    def text(self) -> str:
        """What ``--map`` accepts."""
        stated = asdict(self) | {x or "input": channel for x, channel in self.channels.items()}
        usual = "", 0.0, "states", "runs", "state", self.channels
        pairs = ((x, y) for x, y in stated.items() if x not in SETTINGS or y not in usual)
        return ",".join(f"{name}={value}" for name, value in pairs if name != "channels")

    def __str__(self) -> str:
        return f"--map '{self.text}'"


class FileReading(NamedTuple):
    """Drops as a layout of a file gives them, and the lines that each run comes from."""

    file: TimerFile
    layout: FileLayout
    drops: list[Drop]
    lines: dict[int, list[int]]

    @property
    def is_whole(self) -> bool:
        """Whether beams are clear at the beginning, and in the end, as a protocol has them.

        Where the file says when they are blocked, it is not doubted.
        """
        counts = Counter((drop.run, edge.channel) for drop in self.drops for edge in drop.edges)
        if self.layout.dark.startswith("turns"):
            return not any(n % 2 for n in counts.values())
        began_dark = sum(drop.initial_state.bit_count() for drop in self.drops)
        return self.layout.dark not in {"high", "low"} or began_dark < len(counts)


def read_drops(file: TimerFile, layout: FileLayout, most: int | None = None) -> FileReading:
    """Turn what was understood into drops, a run each, numbered as in the file or from 1.

    Parameters
    ----------
    most
        How many are read, if not all.
    """
    runs, lines, last = dict[int, list[Edge]](), dict[int, list[int]](), 0
    inputs, is_passing = [*layout.channels], layout.groups == "passing"
    grouping = layout.unit, layout.groups, layout.first, layout.pause_s
    for number, events in _group_events(file, *grouping)[:most]:
        edges, rows, counts = list[Edge](), list[int](), Counter[str]()
        share = max(1, len(events) // max(1, len(inputs)))
        for k, event in enumerate(events):
            # Of gates that are passed one after the other, each has as many.
            label = inputs[min(k // share, len(inputs) - 1)] if is_passing else event.label
            channel = layout.channels.get(label)
            if channel is not None:
                edges.append(Edge(event.tick, channel, layout.is_dark(event, counts[label])))
                rows.append(event.line)
                counts[label] += 1
        if edges:
            run = number if number and number not in runs else last + 1
            runs[run], lines[run], last = edges, rows, max(last, run)
    drops = [make_drop(run, runs[run]) for run in sorted(runs)]
    if any(drop.edges[-1].tick > LONGEST_S * TICK_HZ for drop in drops):
        drops, lines = [], {}
    return FileReading(file, layout, drops, lines)


@lru_cache(1)
def _group_events(
    file: TimerFile, unit: str, groups: str, first: str, pause_s: float
) -> list[tuple[int, list[TimerEvent]]]:
    """Return the events of each drop, with its number in the file; those without one come last."""
    limit, scale = round(pause_s * TICK_HZ), 10 ** POWERS[unit or "s"]
    by_row = file.is_wide and groups != "runs"
    parts: dict[tuple[str, int], list[TimerEvent]] = defaultdict(list)
    for event in [file.first, *file.events] if file.first and first == "change" else file.events:
        parts[event.run, event.line if by_row else event.part].append(event)
    numbers = {run: number_of(run) or 0 for run, _ in parts}
    drops = []
    for run, part in sorted(parts, key=lambda x: (not numbers[x[0]], x[1], numbers[x[0]])):
        pieces: list[list[TimerEvent]] = [[]]
        events = parts[run, part]
        if scale > 1:
            events = [event._replace(tick=event.tick // scale) for event in events]
        for event in sorted(events, key=attrgetter("tick")):  # equal ones stay in order
            last = pieces[-1][-1] if pieces[-1] else event
            if 0 < limit <= event.tick - last.tick:
                pieces.append([])
            if last is event or event[:3] != last[:3]:  # nothing does the same twice at once
                pieces[-1].append(event)
        drops += [(numbers[run] if len(pieces) == 1 else 0, piece) for piece in pieces]
    return drops


def input_names(file: TimerFile, groups: str | None, gates: Sequence[int]) -> list[str]:
    """Name the inputs of a file whose parts are grouped so; an empty text where it names none."""
    passing = [f"gate {n}" for n in range(1, len(gates) + 1)]
    return passing if groups == "passing" else [*file.labels] or [""]


def find_layouts(
    file: TimerFile, gates: Sequence[int], bars: int, stated: Mapping[str, Any]
) -> Iterator[FileLayout]:
    """Yield every way in which a file may be read, that which is most usual first.

    Parameters
    ----------
    gates
        Channels, in the order in which the gates are passed.
    stated
        What is decided: attributes of `FileLayout`.
    """
    counts = Counter((event.part, event.label) for event in file.events)
    states = {event.state for event in file.events}
    levels = ["high", "low"] if states & {"high", "low"} else ["states"]
    # More times than bars: it darkens and clears in turns.
    times = ["each", "turns", "turns-clear", "each"][max(counts.values()) > bars :][:3]
    choices: dict[str, Sequence[Any]] = {} if file.has_unit else {"unit": list(POWERS)}
    choices["dark"] = levels if states - {""} else times
    choices["groups"] = _groupings(file, gates, bars)
    choices["first"] = ["state", "change"] if file.first else ["state"]
    choices |= {name: [value] for name, value in stated.items() if name in choices}
    for values in itertools.product(*choices.values()):
        layout = FileLayout(**dict(zip(choices, values, strict=True)))
        maps = [stated["channels"]] if "channels" in stated else _channels(file, gates, layout)
        pauses = [float(stated["pause_s"])] if "pause_s" in stated else _pauses(file, layout)
        for channels, pause in itertools.product(maps, pauses):
            yield replace(layout, channels=channels, pause_s=pause)


def _groupings(file: TimerFile, gates: Sequence[int], bars: int) -> list[str]:
    groups, events = ["runs"], file.events
    # Times that begin anew with each row are of a drop each; of those that go on, pauses tell.
    is_wide = file.is_wide and len({event.line for event in events}) < len(events)
    if is_wide and events != sorted(events, key=attrgetter("tick")):
        groups.insert(0, "rows")
    if len(file.labels) < 2 and bars == 1 and len(gates) > 1:
        groups.append("passing")
    return groups


def _pauses(file: TimerFile, layout: FileLayout) -> list[float]:
    """Return the pause, s, at which drops one after the other are parted, if there may be any.

    Between drops nothing passes for far longer than within one: of the pauses in order, the first
    of half a second or more that is three times as long as the one before.
    """
    drops = _group_events(file, layout.unit, layout.groups, "state", 0.0)
    ticks = [event.tick for event in drops[0][1]] if len(drops) == 1 else []
    pauses = sorted(b - a for a, b in itertools.pairwise(ticks))
    for before, pause in itertools.pairwise(pauses):
        if pause >= max(_CLEAR_PAUSE * before, TICK_HZ / 2):
            return [0.0, pause / TICK_HZ][ticks[-1] - ticks[0] > _LONGEST_S * TICK_HZ :]
    return [0.0]


def _channels(file: TimerFile, gates: Sequence[int], layout: FileLayout) -> list[dict[str, int]]:
    """Return which gate each input may be; by its number if all are told apart by it."""
    labels = input_names(file, layout.groups, gates)
    if layout.groups == "passing":
        return [dict(zip(labels, gates, strict=True))]
    by_number = {x: n for x in labels if (n := number_of(x)) is not None and n in gates}
    if len(set(by_number.values())) == len(labels) and not file.is_counted:
        return [by_number]
    first = {event.label: event.tick for event in sorted(file.events, reverse=True)}
    passed = sorted(labels, key=lambda label: first.get(label, 0))
    # In order of their numbers, or as they are passed first; and the reverse.
    maps = [
        dict(zip(order, chosen[::way], strict=True))
        for order, beams in ((labels, sorted(gates)), (passed, gates))
        for chosen in itertools.combinations(beams, len(labels))
        for way in (1, -1)
    ]
    return maps[:_MOST_MAPS] or [by_number] * bool(by_number)
