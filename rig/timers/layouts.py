"""Ways in which a file may be read: all of them, and the drops as each gives them.

A layout says what a file leaves open: the unit, which level is dark, whether parts are runs or
gates, and which gate each input is.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.records import Drop, Edge
from rig.timers.edge_rows import make_drop
from rig.timers.moments import TICK_HZ
from rig.timers.vocabulary import POWERS, number_of

if TYPE_CHECKING:
    from rig.timers.events import TimerEvent, TimerFile

_LONGEST_S = 60
"""A drop lasts half a second, and nobody waits a minute until it is recorded."""
_CLEAR_PAUSE = 3.0
_MOST_MAPS = 200

SETTINGS = {
    "unit": "|".join(POWERS),
    "dark": "high|low|states|inverted|turns|turns-clear|each",
    "groups": "runs|rows|gates|passing",
    "pause_s": r"[0-9]{1,3}(?:\.[0-9]{0,20})?",
}
"""What each setting may be."""
_DARK = {
    "blocked": ("states", "inverted"),
    "clear": ("states", "inverted"),
    "": ("each", "turns", "turns-clear"),
    "high": ("high", "low"),
    "low": ("high", "low"),
}
"""What may be dark where a file has such a state."""


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
        Whether parts of the file, or its ``rows``, are ``runs``, or parts are ``gates``, or in each
        run all gates stand in the order of the way (``passing``).
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

    def is_dark(self, event: TimerEvent, n: int) -> bool:
        """Whether an event, the n-th of its input, begins a blocked beam."""
        if event.state:
            return (event.state in {"blocked", "high"}) is (self.dark not in {"inverted", "low"})
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
    """Drops as a layout of a file gives them, and the lines that they come from."""

    file: TimerFile
    layout: FileLayout
    drops: list[Drop]
    lines: set[int]

    @property
    def lasting_s(self) -> float:
        """How long the longest run is."""
        return max((drop.edges[-1].tick for drop in self.drops), default=0) / TICK_HZ

    @property
    def is_whole(self) -> bool:
        """Whether beams are clear at the beginning, and in the end, as a protocol has them.

        Where the file says when they are blocked, it is not doubted.
        """
        counts = Counter((drop.run, edge.channel) for drop in self.drops for edge in drop.edges)
        if self.layout.dark.startswith("turns"):
            return not any(n % 2 for n in counts.values())
        began_dark = sum(drop.initial_state.bit_count() for drop in self.drops)
        is_level = self.file.is_sampled and self.layout.dark in {"high", "low"}
        return not is_level or began_dark < len(counts)


def read_drops(file: TimerFile, layout: FileLayout) -> FileReading:
    """Turn what was understood into drops, a run each, numbered as in the file or from 1."""
    inputs, names, power = (
        list(layout.channels),
        _part_names(file),
        10 ** POWERS.get(layout.unit, 0),
    )
    has_gates, passes = layout.groups == "gates", layout.groups == "passing"
    by_row = file.is_wide and layout.groups in {"rows", "passing"}
    limit = round(layout.pause_s * TICK_HZ) * power
    groups: dict[tuple[int, int], list[TimerEvent]] = {}
    cuts, numbers = Counter[int](), dict[int, int | None]()
    events = [(event, n) for n, part in enumerate(file.parts) for event in part.events]
    for event, part in sorted(events, key=lambda row: row[0].tick):  # equal ones stay in order
        group = 0 if has_gates else event.line if by_row else part
        before = groups.get((group, cuts[group]), [event])[-1]
        cuts[group] += 0 < limit <= event.tick - before.tick
        label = event.label or names[part] * has_gates
        groups.setdefault((group, cuts[group]), []).append(event._replace(label=label))
        numbers.setdefault(group, 0 if has_gates else number_of(file.parts[part].run))
    runs, lines = dict[int, list[Edge]](), set[int]()
    for (group, _), drop in sorted(groups.items()):
        number = 0 if cuts[group] else numbers[group]
        run = number if number and number not in runs else max(runs, default=0) + 1
        counts, share = Counter[str](), max(1, len(drop) // max(1, len(inputs)))
        for k, event in enumerate(drop):
            # Where gates pass one after the other, there are as many at each.
            label = inputs[min(k // share, len(inputs) - 1)] if passes else event.label
            if label in layout.channels:
                dark = layout.is_dark(event, counts[label])
                edge = Edge(event.tick // power, layout.channels[label], dark)
                runs.setdefault(run, []).append(edge)
                lines.add(event.line)
                counts[label] += 1
    drops = [make_drop(run, runs[run]) for run in sorted(runs)]
    return FileReading(file, layout, drops, lines)


def input_names(file: TimerFile, groups: str | None, gates: Sequence[int]) -> list[str]:
    """Name the inputs of a file whose parts are grouped so; an empty text where it names none."""
    if groups == "passing":
        return [f"gate {n}" for n in range(1, len(gates) + 1)]
    return _part_names(file) if groups == "gates" else [*file.labels] or [""]


def _part_names(file: TimerFile) -> list[str]:
    """Name the parts of a file that stand one below, or beside, the other."""
    labels = [{event.label for event in part.events} for part in file.parts]
    inputs = [min(own) for own in labels if len(own) == 1]
    for names in inputs, [part.name for part in file.parts]:
        if len(set(names) - {""}) == len(labels):
            return names
    return [f"part {n}" for n in range(1, len(labels) + 1)]


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
    counts = Counter((n, e.label) for n, part in enumerate(file.parts) for e in part.events)
    states = {event.state for part in file.parts for event in part.events}
    dark = next(ways for state, ways in _DARK.items() if state in states)
    choices: dict[str, Sequence[Any]] = {
        "unit": list(POWERS) if file.is_counted else [""],
        # More times than bars: it darkens and clears in turns.
        "dark": dark[-2:] + dark[:-2] if max(counts.values()) > bars else dark,
        "groups": _groupings(file, gates, bars),
    }
    said = {"unit"} if file.has_unit else set()
    choices |= {name: [value] for name, value in stated.items() if name in choices.keys() - said}
    for unit, dark, groups in itertools.product(*choices.values()):
        power = POWERS[unit or "s"]
        pauses = [float(stated["pause_s"])] if "pause_s" in stated else _pauses(file, power, groups)
        maps = [stated["channels"]] if "channels" in stated else _channels(file, gates, groups)
        for channels, pause in itertools.product(maps, pauses):
            yield FileLayout(unit, dark, groups, pause, channels)


def _groupings(file: TimerFile, gates: Sequence[int], bars: int) -> list[str]:
    groups, parts = ["runs"], len(file.parts)
    if parts > 1 and set(_part_names(file)) == set(file.labels):
        groups.insert(0, "gates")
    elif 1 < parts == len(gates) and not (file.labels or any(part.run for part in file.parts)):
        groups.append("gates")
    if file.is_wide:
        ticks = [event.tick for event in file.parts[0].events]
        # Times that begin anew with each row are of a drop each.
        groups.insert(0 if parts > 1 or ticks != sorted(ticks) else 1, "rows")
    if (file.is_wide or len(file.labels) < 2) and bars == 1 and len(gates) > 1:
        groups.append("passing")
    return groups


def _pauses(file: TimerFile, power: int, groups: str) -> list[float]:
    """Return the pause, s, at which drops one after the other are parted, if there may be any.

    Between drops nothing passes for far longer than ever within one: the pauses in order, the
    widest step from one to the next, by a factor of 3 at least, up to half a second or more.
    """
    is_parted = file.is_wide or groups == "gates" or (len(file.parts) > 1 and groups == "runs")
    for part in [] if is_parted else file.parts:
        ticks = sorted(event.tick // 10**power for event in part.events)
        pauses = sorted(b - a for a, b in itertools.pairwise(ticks))
        steps = [(b / max(a, TICK_HZ // 1000), b) for a, b in itertools.pairwise(pauses)]
        ratio, pause = max((step for step in steps if 2 * step[1] >= TICK_HZ), default=(0.0, 0))
        if ratio >= _CLEAR_PAUSE:
            is_long = ticks[-1] - ticks[0] > _LONGEST_S * TICK_HZ
            return [0.0, pause / TICK_HZ][is_long:]
    return [0.0]


def _channels(file: TimerFile, gates: Sequence[int], groups: str) -> list[dict[str, int]]:
    """Return which gate each input may be; by its number if all are told apart by it."""
    labels = input_names(file, groups, gates)
    if groups == "passing":
        return [dict(zip(labels, gates, strict=True))]
    by_number = {x: n for x in labels if (n := number_of(x)) is not None and n in gates}
    if by_number and (len(set(by_number.values())) == len(labels) or len(labels) == 1):
        return [by_number]
    if len(labels) < 2:
        return [{labels[0]: channel} for channel in gates]
    first = {e.label: e.tick for part in file.parts for e in reversed(part.events)}
    passed = sorted(labels, key=lambda label: first.get(label, 0))
    # In order of their numbers, or as they are passed first; and the reverse.
    maps = [
        dict(zip(order, chosen[::way], strict=True))
        for order, beams in ((labels, sorted(gates)), (passed, gates))
        for chosen in itertools.combinations(beams, len(labels))
        for way in (1, -1)
    ]
    return ([by_number] if by_number and len(labels) > len(gates) else []) + maps[:_MOST_MAPS]
