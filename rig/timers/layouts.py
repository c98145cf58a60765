"""Ways in which a file may be read: all of them, and the drops as each gives them.

A layout says what a file leaves open: the unit, which level is dark, whether parts are runs or
gates, and which gate each input is.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.records import Drop, Edge
from rig.timers.moments import TICK_HZ
from rig.timers.vocabulary import POWERS, number_of

if TYPE_CHECKING:
    from rig.timers.events import TimerEvent
    from rig.timers.timer_file import TimerFile

_LONGEST_S = 60
"""A drop lasts half a second, and nobody waits a minute until it is recorded."""
_CLEAR_PAUSE = 3.0
_MOST_MAPS = 200

SETTINGS = {
    "unit": "|".join(POWERS),
    "dark": "high|low|states|inverted|turns|turns-clear|each",
    "groups": "runs|gates|passing",
    "pause_s": r"[0-9]{1,3}(?:\.[0-9]{0,20})?",
}
"""What each setting may be."""


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
        Whether parts of the file are ``runs`` or ``gates``, or all gates stand in the order of the
        way (``passing``).
    pause_s
        Beyond which a pause parts two runs; 0 for none.
    channels
        Of each input; of the empty text where the file names none.
    """

    unit: str = ""
    dark: str = "states"
    groups: str = "runs"
    pause_s: float = 0.0
    channels: Mapping[str, int] = field(default_factory=dict)

    @classmethod
    def own(cls, file: TimerFile) -> FileLayout:
        """Return that of the project's own format, in which inputs are called by channels."""
        return cls(channels={label: int(label) for label in file.labels})

    def is_dark(self, event: TimerEvent, n: int) -> bool:
        """Whether an event, the n-th of its input, begins a blocked beam."""
        if event.state in {"blocked", "clear"}:
            return (event.state == "blocked") is (self.dark != "inverted")
        if event.state:
            return (event.state == "high") is (self.dark != "low")
        return self.dark == "each" or (n % 2 == 0) is (self.dark != "turns-clear")

    @property
    def text(self) -> str:
        """What ``--map`` accepts."""
        stated = {name: value for name, value in asdict(self).items() if name in SETTINGS and value}
        stated |= {label or "input": channel for label, channel in self.channels.items()}
        usual = {"states", "runs"}
        return ",".join(f"{name}={value}" for name, value in stated.items() if value not in usual)

    def __str__(self) -> str:
        return f"--map '{self.text}'"


class FileReading(NamedTuple):
    """Drops as a layout gives them, and the lines of the file that they come from."""

    layout: FileLayout
    drops: list[Drop]
    lines: set[int]

    @property
    def is_whole(self) -> bool:
        """Whether beams that darken and clear in turns do both equally often."""
        counts = Counter((drop.run, edge.channel) for drop in self.drops for edge in drop.edges)
        return not self.layout.dark.startswith("turns") or not any(n % 2 for n in counts.values())


def read_drops(file: TimerFile, layout: FileLayout) -> FileReading:
    """Turn what was understood into drops, a run each, numbered as in the file or from 1."""
    runs: dict[int, Drop] = {}
    lines, power = set[int](), 10 ** POWERS.get(layout.unit, 0)
    for events, number in _runs(file, layout):
        counts, edges, first = Counter[str](), list[Edge](), dict[int, bool]()
        for event in events:
            if event.label in layout.channels:
                channel = layout.channels[event.label]
                dark = layout.is_dark(event, counts[event.label])
                edges.append(Edge(event.tick // power, channel, dark))
                first.setdefault(channel, dark)
                lines.add(event.line)
                counts[event.label] += 1
        if edges:  # they are counted from the whole second before them
            run = number if number and number not in runs else max(runs, default=0) + 1
            start = edges[0].tick // TICK_HZ * TICK_HZ
            stamps = tuple(edge._replace(tick=edge.tick - start) for edge in edges)
            clear = sum(1 << channel for channel, blocked in first.items() if not blocked)
            runs[run] = Drop(run, 1, TICK_HZ, stamps, initial_state=clear)
    return FileReading(layout, [runs[run] for run in sorted(runs)], lines)


def _runs(file: TimerFile, layout: FileLayout) -> Iterator[tuple[list[TimerEvent], int]]:
    """Yield the events of each run in order, with its number where the file says it."""
    parts = [(part.events, part.number) for part in file.parts]
    if layout.groups == "gates":
        names = zip(part_names(file), file.parts, strict=True)
        parts = [([e._replace(label=e.label or name) for name, p in names for e in p.events], 0)]
    limit = round(layout.pause_s * TICK_HZ) * 10 ** POWERS.get(layout.unit, 0)
    gates = list(layout.channels)
    for events, number in parts:
        ordered = sorted(events, key=lambda event: event.tick)  # equal times stay in their order
        gaps = [b.tick - a.tick for a, b in itertools.pairwise(ordered)]
        cuts = [0, *(n for n, gap in enumerate(gaps, 1) if limit and gap >= limit), len(ordered)]
        for begin, end in itertools.pairwise(cuts):
            run = ordered[begin:end]
            if layout.groups == "passing":  # as many at each gate
                size = max(1, len(run) // len(gates))
                run = [
                    e._replace(label=gates[min(k // size, len(gates) - 1)])
                    for k, e in enumerate(run)
                ]
            yield run, number if len(cuts) == 2 else 0


def part_names(file: TimerFile) -> list[str]:
    """Name the parts of a file that stand one below, or beside, the other."""
    if _is_part_a_gate(file):
        return [part.events[0].label for part in file.parts]
    names = [part.name for part in file.parts]
    is_clear = "" not in names and len(set(names)) == len(names)
    return names if is_clear else [f"part {n}" for n in range(1, len(names) + 1)]


def find_layouts(
    file: TimerFile, gates: Sequence[int], bars: int, stated: Mapping[str, Any]
) -> list[FileLayout]:
    """Return every way in which a file may be read, that which is most usual first.

    Parameters
    ----------
    gates
        Channels, in the order in which the gates are passed.
    stated
        What is decided: attributes of `FileLayout`.
    """
    choices: dict[str, Sequence[Any]] = {
        "unit": [""] if file.has_unit else list(POWERS),
        "dark": _darkness(file, bars),
        "groups": _groupings(file, gates, bars),
    }
    choices |= {name: [value] for name, value in stated.items() if name in choices}
    layouts = []
    for layout in itertools.starmap(FileLayout, itertools.product(*choices.values())):
        pauses = [float(stated["pause_s"])] if "pause_s" in stated else _pauses(file, layout)
        maps = [stated["channels"]] if "channels" in stated else _channels(file, gates, layout)
        layouts += [
            replace(layout, pause_s=pause, channels=channels)
            for channels, pause in itertools.product(maps, pauses)
        ]
    return layouts


def _darkness(file: TimerFile, bars: int) -> list[str]:
    firsts = [{event.label: event.state for event in reversed(part.events)} for part in file.parts]
    states = [state for labels in firsts for state in labels.values()]
    if {"blocked", "clear"} & set(states):
        return ["states", "inverted"]
    if "" in states:
        most = max(
            Counter(e.label for e in part.events).most_common(1)[0][1] for part in file.parts
        )
        return ["turns", "turns-clear", "each"] if most > bars else ["each", "turns", "turns-clear"]
    order = ["low", "high"] if states.count("low") * 2 > len(states) else ["high", "low"]
    # A protocol has all beams clear before the release: where all inputs begin alike, that level
    # is the clear one.
    return order[:1] if file.is_sampled and len(set(states)) == 1 else order


def _is_part_a_gate(file: TimerFile) -> bool:
    """Whether each part of a file is of an input of its own."""
    labels = [{event.label for event in part.events} for part in file.parts]
    own = set().union(*labels)
    return "" not in own and len(own) == len(labels) == sum(map(len, labels))


def _groupings(file: TimerFile, gates: Sequence[int], bars: int) -> list[str]:
    parts = len(file.parts)
    if parts > 1 and _is_part_a_gate(file):
        return ["gates", "runs"]
    if not (file.labels or any(part.number for part in file.parts)) and 1 < parts == len(gates):
        return ["runs", "gates"]
    single = len(file.labels) < 2 and bars == 1 and len(gates) > 1
    return ["runs", "passing"] if single else ["runs"]


def _pauses(file: TimerFile, layout: FileLayout) -> list[float]:
    """Return the pause, s, at which drops one after the other are parted, if there may be any.

    Between drops nothing passes for far longer than ever within one: the pauses in order, the
    widest step from one to the next, by a factor of 3 at least, up to half a second or more.
    """
    is_parted = layout.groups == "gates" or (len(file.parts) > 1 and layout.groups != "passing")
    for part in [] if is_parted else file.parts:
        ticks = sorted(event.tick // 10 ** POWERS.get(layout.unit, 0) for event in part.events)
        pauses = sorted(b - a for a, b in itertools.pairwise(ticks))
        steps = [(b / max(a, TICK_HZ // 1000), b) for a, b in itertools.pairwise(pauses)]
        ratio, pause = max((step for step in steps if 2 * step[1] >= TICK_HZ), default=(0.0, 0))
        if ratio >= _CLEAR_PAUSE:
            is_long = ticks[-1] - ticks[0] > _LONGEST_S * TICK_HZ
            return [0.0, pause / TICK_HZ][is_long:]
    return [0.0]


def _channels(file: TimerFile, gates: Sequence[int], layout: FileLayout) -> list[dict[str, int]]:
    """Return which gate each input may be; by its number if all are told apart by it."""
    labels = part_names(file) if layout.groups == "gates" else list(file.labels)
    if layout.groups == "passing":
        return [{f"gate {n}": channel for n, channel in enumerate(gates, 1)}]
    by_number = {x: n for x in labels if (n := number_of(x)) is not None and n in gates}
    if by_number and (len(set(by_number.values())) == len(labels) or len(labels) == 1):
        return [by_number]
    if len(labels) < 2:
        return [{"".join(labels): channel} for channel in gates]
    # In order of their numbers, or as they are passed first; and the reverse.
    first = {e.label: e.tick for part in file.parts for e in reversed(part.events)}
    rows = [(labels, chosen) for chosen in itertools.combinations(sorted(gates), len(labels))]
    if len(labels) == len(gates):
        rows += [(sorted(labels, key=lambda label: first.get(label, 0)), tuple(gates))]
    rows += [(inputs, chosen[::-1]) for inputs, chosen in rows]
    maps = [dict(zip(inputs, chosen, strict=True)) for inputs, chosen in rows[:_MOST_MAPS]]
    return [by_number, *maps] if by_number and len(labels) > len(gates) else maps
