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
_MOST_MAPS = 200

_CHOICES = {
    "unit": ("", *POWERS),
    "dark": ("high", "low", "states", "inverted", "turns", "turns-clear", "each"),
    "groups": ("runs", "gates", "passing"),
}
SETTINGS = (*_CHOICES, "pause_s")


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

    @property
    def power(self) -> int:
        """Decimal power of the unit, where the file does not say it."""
        return POWERS.get(self.unit, 0)

    @property
    def is_contrary(self) -> bool:
        """Whether it contradicts what the file says."""
        return self.dark == "inverted"

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
    def is_guess(self) -> bool:
        """Whether the file does not say when a beam is blocked."""
        return self.layout.dark not in {"states", "inverted"}

    @property
    def is_whole(self) -> bool:
        """Whether beams that darken and clear in turns do both equally often."""
        counts = Counter((drop.run, edge.channel) for drop in self.drops for edge in drop.edges)
        return not self.layout.dark.startswith("turns") or not any(n % 2 for n in counts.values())


def read_drops(file: TimerFile, layout: FileLayout) -> FileReading:
    """Turn what was understood into drops, a run each, numbered as in the file or from 1."""
    runs: dict[int, list[Passage]] = {}
    for run, number in _runs(file, layout):
        runs[number if number and number not in runs else max(runs, default=0) + 1] = run
    drops, lines = [], set[int]()
    for number, run in sorted(runs.items()):
        counts, edges = Counter[str](), []
        for passage in run:
            if passage.label in layout.channels:
                dark = _is_dark(passage, layout.dark, counts[passage.label])
                tick = passage.tick // 10**layout.power
                edges.append(Edge(tick, layout.channels[passage.label], dark))
                lines.add(passage.line)
                counts[passage.label] += 1
        if edges:
            drops.append(drop_of(number, edges))
    return FileReading(layout, drops, lines)


def _runs(file: TimerFile, layout: FileLayout) -> Iterable[tuple[list[Passage], int]]:
    """Yield the passages of each run in order, with its number where the file says it."""
    parts = [(group.passages, group.number) for group in file.groups]
    if layout.groups == "gates":
        names = zip(part_names(file), file.groups, strict=True)
        parts = [([p._replace(label=p.label or name) for name, g in names for p in g.passages], 0)]
    limit = round(layout.pause_s * TICK_HZ) * 10**layout.power
    for passages, number in parts:
        ordered = sorted(passages, key=lambda passage: passage.tick)
        gaps = [b.tick - a.tick for a, b in itertools.pairwise(ordered)]
        cuts = [0, *(n for n, gap in enumerate(gaps, 1) if limit and gap >= limit), len(ordered)]
        for begin, end in itertools.pairwise(cuts):
            run = ordered[begin:end]
            if layout.groups == "passing":
                # As many passages at each gate, in the order of the way.
                size, names_ = max(1, len(run) // len(layout.channels)), list(layout.channels)
                last = len(names_) - 1
                run = [p._replace(label=names_[min(k // size, last)]) for k, p in enumerate(run)]
            yield run, number if len(cuts) == 2 else 0


def _is_dark(passage: Passage, dark: str, n: int) -> bool:
    if passage.blocked is not None:
        return passage.blocked is (dark != "inverted")
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
    choices: dict[str, Sequence[Any]] = {
        "unit": list(POWERS),
        "dark": _darkness(file, bars),
        "groups": _groupings(file, gates, bars),
    }
    choices |= {name: [value] for name, value in stated.items() if name in choices}
    if file.has_unit:
        choices["unit"] = [""]
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


def _darkness(file: TimerFile, bars: int) -> list[str]:
    by_input = Counter[tuple[int, str]]()
    first: dict[tuple[int, str], Passage] = {}
    for n, group in enumerate(file.groups):
        by_input.update((n, passage.label) for passage in group.passages)
        first = {(n, passage.label): passage for passage in reversed(group.passages)} | first
    if all(passage.blocked is not None for passage in first.values()):
        return ["states", "inverted"]
    if all(passage.high is None for passage in first.values()):
        both = max(by_input.values()) > bars
        return ["turns", "turns-clear", "each"] if both else ["each", "turns", "turns-clear"]
    begins = [file.begins.get(label, not passage.high) for (_, label), passage in first.items()]
    order = ["low", "high"] if sum(begins) * 2 > len(begins) else ["high", "low"]
    # A protocol has all beams clear before the release: where all inputs begin alike, that level
    # is the clear one.
    return order[:1] if file.begins and len(set(begins)) == 1 else order


def _is_part_a_gate(file: TimerFile) -> bool:
    """Whether each part of a file is of an input of its own."""
    labels = [{passage.label for passage in group.passages} for group in file.groups]
    alone = all(len(part) == 1 and "" not in part for part in labels)
    return alone and len(set().union(*labels)) == len(labels)


def _groupings(file: TimerFile, gates: Sequence[int], bars: int) -> list[str]:
    parts, named = len(file.groups), any(group.number for group in file.groups)
    if parts > 1 and _is_part_a_gate(file):
        return ["gates", "runs"]
    if not file.labels and 1 < parts == len(gates) and not named:
        return ["runs", "gates"]
    single = len(file.labels) < 2 and bars == 1 and len(gates) > 1
    return ["runs", "passing"] if single else ["runs"]


def _pauses(file: TimerFile, layout: FileLayout) -> list[float]:
    if layout.groups == "gates" or (len(file.groups) > 1 and layout.groups != "passing"):
        return [0.0]
    for group in file.groups:
        ticks = sorted(passage.tick // 10**layout.power for passage in group.passages)
        if pause := widest_pause(ticks) / TICK_HZ:
            return [pause] if ticks[-1] - ticks[0] > MAX_SPAN_S * TICK_HZ else [0.0, pause]
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
    first = {p.label: p.tick for group in file.groups for p in reversed(group.passages)}
    ordered = sorted(labels, key=lambda label: numbers[label] or 0) if distinct else labels
    # In order of their numbers, or as they are passed first; and the reverse.
    rows = [(ordered, chosen) for chosen in itertools.combinations(sorted(gates), len(labels))]
    if len(labels) == len(gates):
        rows += [(sorted(labels, key=lambda label: first.get(label, 0)), tuple(gates))]
    rows += [(inputs, chosen[::-1]) for inputs, chosen in rows]
    maps = [dict(zip(inputs, chosen, strict=True)) for inputs, chosen in rows[:_MOST_MAPS]]
    return [by_number, *maps] if by_number and len(labels) > len(gates) else maps


def choose(
    readings: Sequence[FileReading],
    place: str,
    fit: Callable[[Sequence[Drop], bool], FallMatch],
    *,
    is_stated: bool,
) -> tuple[FileReading, FallMatch]:
    """Return the reading that a fall of the protocol bears out, and how well.

    Parameters
    ----------
    place
        What a refusal begins with: the name of the file.
    fit
        Compares drops with falls; roughly, or with the evidence that weighs readings.
    is_stated
        Whether the user said which input is which gate: such a reading, if there is no other, is
        taken whatever falls say.

    Raises
    ------
    InputError
        Where several readings are as good, or none is credible.
    """
    readings = [reading for reading in readings if reading.is_whole] or readings
    distinct = {repr(reading.drops): reading for reading in reversed(readings) if reading.drops}
    candidates = list(reversed(distinct.values()))
    if is_stated and len(candidates) == 1:
        return candidates[0], fit(candidates[0].drops, True)
    rough = [(fit(reading.drops, False).share, reading) for reading in candidates]
    rough.sort(key=lambda row: -row[0])
    best = rough[0][0]
    near = [reading for share, reading in rough if share >= best - _CLOSE][:_FINALISTS]
    ranked = [(fit(reading.drops, True), reading) for reading in near]
    # What the file says comes first: the contrary may be proposed, and is never taken.
    ranked = [row for row in ranked if row[0].share >= GOOD and not row[1].layout.is_contrary]
    ranked.sort(key=lambda row: -row[0].evidence)
    if not ranked:
        options = [str(reading.layout) for share, reading in rough if share >= GOOD]
        options = options or [str(reading.layout) for _, reading in rough if reading.is_guess]
        share = max(share for share, reading in rough if not reading.layout.is_contrary)
        listed = "; ".join([*options[:3], "--as-read"])
        raise refusal(place, "no_reading_fits", share=100 * share, options=listed)
    (first, reading), *rest = ranked
    if rest and first.evidence - rest[0][0].evidence < _DECISIVE:
        options = [str(row[1].layout) for row in ranked[:2]]
        raise refusal(place, "several_readings", options=" or ".join(options))
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
        content = None
    return check_layout(content, path)


def check_layout(content: object, place: str) -> dict[str, Any]:
    """Return settings that a layout may have.

    Raises
    ------
    InputError
        Other settings, with what is accepted.
    """
    settings = content if isinstance(content, dict) else {"content": content}
    for name, value in settings.items():
        if name == "channels":
            channels = value.values() if isinstance(value, dict) else [value]
            good = all(type(channel) is int and 0 <= channel < GATES for channel in channels)
        elif name == "pause_s":
            good = type(value) in (int, float) and 0 <= float(str(value)) <= 3600
        else:
            good = value in _CHOICES.get(name, ())
        if not good:
            raise refusal(place, "layout_unclear", text=f"{name}: {value!s:.40}")
    return settings


def save_layout(layout: FileLayout, path: str) -> None:
    """Write a layout for `read_layout`."""
    text = json.dumps(asdict(layout), indent=2, ensure_ascii=False)
    Path(path).write_text(text + "\n", "utf-8")
