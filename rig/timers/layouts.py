"""Ways in which a file may be read, and which of them the protocol's own fall bears out.

A layout says what a file leaves open: the unit, which level is dark, whether parts are runs or
gates, and which gate each input is. Every possible one is tried; the best is proposed with its
evidence, and what no fall decides is asked.
"""

from __future__ import annotations

import itertools
import json
from collections import Counter
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.boards import GATES
from rig.records import Edge
from rig.timers.edges_csv import TICK_HZ, drop_of
from rig.timers.passages import widest_pause
from rig.timers.problems import refusal
from rig.timers.vocabulary import POWERS, number_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rig.records import Drop
    from rig.timers.passages import Passage
    from rig.timers.timer_file import TimerFile

MAX_SPAN_S = 60
"""A drop lasts half a second, and nobody waits a minute until it is recorded."""
GOOD = 0.75
"""Share of the edges near a fall's, of all that came or were due, that makes a reading credible."""
_CLOSE = 0.1
_DECISIVE = 7.0
"""Logarithm of the odds beyond which a reading is taken without a question: 1,000 to 1."""
_FINALISTS = 6
SETTINGS = ("unit", "dark", "groups", "pause_s")
ACCEPTED = {
    "unit": ("", *POWERS),
    "dark": ("high", "low", "states", "turns", "turns-clear", "each"),
    "groups": ("runs", "gates", "passing"),
}


@dataclass(frozen=True, slots=True)
class FileLayout:
    """What a file leaves open.

    Attributes
    ----------
    unit
        Of the times; empty where the file says it.
    dark
        Which level is that of a blocked beam, ``high`` or ``low``; ``states`` where the file says
        when a beam is blocked; of times alone, whether the beam darkens and clears in turns, clears
        first (``turns-clear``), or darkens at ``each``.
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

    def __str__(self) -> str:
        settings = [
            f"{name}={value}"
            for name, value in asdict(self).items()
            if name != "channels" and value and value not in {"states", "runs"}
        ]
        inputs = [f"{label or 'input'}={channel}" for label, channel in self.channels.items()]
        return f"--map '{','.join([*settings, *inputs])}'"


class FallMatch(NamedTuple):
    """How well drops are like falls of the protocol.

    Attributes
    ----------
    share
        Edges near a fall's, of all that came or were due, from 0 to 1.
    evidence
        Logarithm of the marginal likelihood; 0 if not asked for.
    text
        What a user can check.
    """

    share: float
    evidence: float = 0.0
    text: str = ""


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
    power = POWERS[layout.unit] if layout.unit and not file.has_unit else 0
    runs: dict[int, list[Passage]] = {}
    for run, number in _runs(file, layout):
        free = number if number and number not in runs else max(runs, default=0) + 1
        runs[free] = run
    drops, lines = [], set[int]()
    for number, run in sorted(runs.items()):
        edges: list[Edge] = []
        by_label: dict[str, list[Passage]] = {}
        for passage in run:
            by_label.setdefault(passage.label, []).append(passage)
        for label, passages in by_label.items():
            if label in layout.channels:
                lines |= {passage.line for passage in passages}
                for n, passage in enumerate(passages):
                    tick = passage.tick // 10**power
                    dark = _is_dark(passage, layout.dark, n)
                    edges.append(Edge(tick, layout.channels[label], dark))
        if edges:
            drops.append(drop_of(number, edges))
    return FileReading(layout, drops, lines)


def _runs(file: TimerFile, layout: FileLayout) -> Iterable[tuple[list[Passage], int]]:
    """Yield the passages of each run, with its number where the file says it."""
    if layout.groups == "gates":
        merged = [
            passage._replace(label=passage.label or label)
            for label, group in zip(part_names(file), file.groups, strict=True)
            for passage in group.passages
        ]
        parts = [(merged, 0)]
    else:
        parts = [(group.passages, group.number) for group in file.groups]
    for passages, number in parts:
        ordered = sorted(passages, key=lambda passage: passage.tick)
        power = POWERS[layout.unit] if layout.unit and not file.has_unit else 0
        limit = round(layout.pause_s * TICK_HZ) * 10**power or None
        begin = 0
        split = False
        for n in range(1, len(ordered) + 1):
            last = n == len(ordered)
            if last or (limit and ordered[n].tick - ordered[n - 1].tick >= limit):
                run = ordered[begin:n]
                split |= not last
                if layout.groups == "passing":
                    size = max(1, len(run) // len(layout.channels))
                    names = list(layout.channels)
                    run = [
                        p._replace(label=names[min(k // size, len(names) - 1)])
                        for k, p in enumerate(run)
                    ]
                yield run, 0 if split else number
                begin = n


def _is_dark(passage: Passage, dark: str, n: int) -> bool:
    if passage.blocked is not None:
        return passage.blocked
    if passage.high is not None:
        return passage.high is (dark != "low")
    return dark == "each" or (n % 2 == 0) is (dark != "turns-clear")


def part_names(file: TimerFile) -> list[str]:
    """Name the parts of a file that stand one below, or beside, the other."""
    if _is_part_a_gate(file):
        return [group.passages[0].label for group in file.groups]
    names = [group.name for group in file.groups]
    alike = len(set(names)) < len(names) or "" in names
    return [f"part {n}" for n in range(1, len(names) + 1)] if alike else names


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
    passages = [passage for group in file.groups for passage in group.passages]
    choices: dict[str, Sequence[Any]] = {
        "unit": [""] if file.has_unit else list(POWERS),
        "dark": _darkness(file, passages, bars),
        "groups": _groupings(file, gates, bars),
    }
    choices |= {name: [value] for name, value in stated.items() if name in choices}
    layouts = []
    for values in itertools.product(*choices.values()):
        layout = FileLayout(*values)
        pauses = [stated["pause_s"]] if "pause_s" in stated else _pauses(file, layout)
        maps = [stated["channels"]] if "channels" in stated else _channels(file, gates, layout)
        layouts += [
            replace(layout, pause_s=pause, channels=channels)
            for channels in maps
            for pause in pauses
        ]
    return layouts


def _darkness(file: TimerFile, passages: Sequence[Passage], bars: int) -> list[str]:
    if any(passage.high is not None for passage in passages):
        moved = {passage.label for passage in passages}
        begins = [high for label, high in file.begins.items() if label in moved]
        if not begins:  # the first edge of a beam darkens it
            first: dict[tuple[int, str], bool] = {}
            for n, group in enumerate(file.groups):
                for passage in group.passages:
                    first.setdefault((n, passage.label), passage.high is True)
            starts = [not high for high in first.values()]
        else:
            starts = begins
        order = ["low", "high"] if sum(starts) * 2 > len(starts) else ["high", "low"]
        # A protocol has all beams clear before the release: where all inputs begin alike, that
        # level is the clear one.
        return order[:1] if begins and len(set(begins)) == 1 else order
    if any(passage.blocked is None for passage in passages):
        counts: dict[tuple[int, str], int] = {}
        for n, group in enumerate(file.groups):
            for passage in group.passages:
                counts[n, passage.label] = counts.get((n, passage.label), 0) + 1
        both = max(counts.values()) > bars
        return ["turns", "turns-clear", "each"] if both else ["each", "turns", "turns-clear"]
    return ["states"]


def _is_part_a_gate(file: TimerFile) -> bool:
    """Whether each part of a file is of an input of its own."""
    labels = [{passage.label for passage in group.passages} for group in file.groups]
    return "" not in set().union(*labels) and sum(map(len, labels)) == len(labels) == len(
        file.labels
    )


def _groupings(file: TimerFile, gates: Sequence[int], bars: int) -> list[str]:
    if len(file.groups) > 1 and _is_part_a_gate(file):
        return ["gates", "runs"]
    bare = not file.labels
    named = any(group.number for group in file.groups)
    if bare and 1 < len(file.groups) == len(gates) and not named:
        return ["runs", "gates"]
    single = len(file.labels) < 2 and bars == 1 and len(gates) > 1
    return ["runs", "passing"] if single else ["runs"]


def _pauses(file: TimerFile, layout: FileLayout) -> list[float]:
    if layout.groups == "gates" or (len(file.groups) > 1 and layout.groups != "passing"):
        return [0.0]
    scale = TICK_HZ * 10 ** (POWERS[layout.unit] if layout.unit and not file.has_unit else 0)
    for group in file.groups:
        ticks = sorted(passage.tick for passage in group.passages)
        pause = widest_pause([tick * TICK_HZ // scale for tick in ticks]) / TICK_HZ
        if pause:
            whole = (ticks[-1] - ticks[0]) / scale > MAX_SPAN_S
            return [pause] if whole else [0.0, pause]
    return [0.0]


def _channels(file: TimerFile, gates: Sequence[int], layout: FileLayout) -> list[dict[str, int]]:
    """Return which gate each input may be; by its number if all are told apart by it."""
    labels = part_names(file) if layout.groups == "gates" else list(file.labels)
    if layout.groups == "passing":
        return [{f"gate {n}": channel for n, channel in enumerate(gates, 1)}]
    if not labels:
        return [{"": channel} for channel in gates]
    numbers = {label: number_of(label) for label in labels}
    by_number = {label: n for label, n in numbers.items() if n is not None and n in gates}
    if len(set(by_number.values())) == len(by_number) == len(labels):
        return [by_number]
    if len(labels) == 1:
        return [by_number] if by_number else [{labels[0]: channel} for channel in gates]
    distinct = len({n for n in numbers.values() if n is not None}) == len(labels)
    ordered = sorted(labels, key=lambda label: numbers[label] or 0) if distinct else labels
    maps = [dict(zip(ordered, chosen, strict=True))
            for chosen in _assignments(sorted(gates), gates, len(labels))]  # fmt: skip
    if by_number and len(labels) > len(gates):
        maps.insert(0, by_number)
    return maps


def _assignments(ordered: Sequence[int], passed: Sequence[int], count: int) -> list[list[int]]:
    """Return channels for inputs in order: by number, as they are passed, and the reverse."""
    starts = range(len(ordered) - count + 1)
    rows = [tuple(gates[n : n + count]) for gates in (ordered, passed) for n in starts]
    return [list(row) for row in dict.fromkeys([*rows, *(row[::-1] for row in rows)])]


def choose(
    readings: Sequence[FileReading], place: str, fit: Callable[[Sequence[Drop], bool], FallMatch]
) -> tuple[FileReading, FallMatch]:
    """Return the reading that a fall of the protocol bears out, and how well.

    Parameters
    ----------
    place
        What a refusal begins with: the name of the file.
    fit
        Compares drops with falls; roughly, or with the evidence that weighs readings.

    Raises
    ------
    InputError
        Where several readings are as good, or none is credible.
    """
    readings = [reading for reading in readings if reading.is_whole] or readings
    distinct = {repr(reading.drops): reading for reading in reversed(readings) if reading.drops}
    candidates = list(reversed(distinct.values()))
    if len(candidates) == 1:
        return candidates[0], fit(candidates[0].drops, True)
    rough = [(fit(reading.drops, False).share, reading) for reading in candidates]
    rough.sort(key=lambda row: -row[0])
    best = rough[0][0]
    near = [reading for share, reading in rough if share >= best - _CLOSE][:_FINALISTS]
    ranked = [(fit(reading.drops, True), reading) for reading in near]
    ranked.sort(key=lambda row: (row[0].share < GOOD, -row[0].evidence))
    (first, reading), *rest = ranked
    if best < GOOD or first.share < GOOD:
        options = "; ".join(str(reading.layout) for _, reading in rough[:3])
        raise refusal(place, "no_reading_fits", share=100 * best, options=options)
    if rest and rest[0][0].share >= GOOD and first.evidence - rest[0][0].evidence < _DECISIVE:
        options = " or ".join(str(row[1].layout) for row in ranked[:2])
        raise refusal(place, "several_readings", options=options)
    return reading, first


def read_layout(path: str) -> dict[str, Any]:
    """Read what a file of `save_layout` decides.

    Raises
    ------
    InputError
        A file that cannot be read, or has another content.
    """
    try:
        content = json.loads(Path(path).read_bytes()[:1_000_000].decode("utf-8"))
    except OSError as error:
        raise refusal(path, "unreadable", text=error.strerror or "") from error
    except (ValueError, RecursionError):
        content = "this file"
    return check_layout(content, path)


def check_layout(content: object, place: str) -> dict[str, Any]:
    """Return settings that a layout may have.

    Raises
    ------
    InputError
        Other settings, with what is accepted.
    """
    accepted = {
        **{name: f"accepted: {', '.join(filter(None, ACCEPTED[name]))}" for name in ACCEPTED},
        "pause_s": "accepted: a number of seconds from 0 to 3600",
        "channels": 'accepted: {"INPUT": CHANNEL}',
    }
    if not isinstance(content, dict):
        listed = ", ".join(accepted)
        values = {"text": str(content), "accepted": f"a mapping; accepted: {listed}"}
        raise refusal(place, "not_accepted", **values)
    for name, value in content.items():
        if name in ACCEPTED:
            good = value in ACCEPTED[name]
        elif name == "pause_s":
            good = type(value) in {int, float} and 0 <= value <= 3600
        else:
            good = (
                name == "channels"
                and isinstance(value, dict)
                and all(type(channel) is int and 0 <= channel < GATES for channel in value.values())
            )
        if not good:
            meant = accepted.get(name, f"accepted: {', '.join(accepted)}")
            values = {"text": f"{name}: {value}", "accepted": f"a setting; {meant}"}
            raise refusal(place, "not_accepted", **values)
    return content


def save_layout(layout: FileLayout, path: str) -> None:
    """Write a layout for `read_layout`."""
    text = json.dumps(asdict(layout), indent=2, ensure_ascii=False)
    Path(path).write_text(text + "\n", "utf-8")
