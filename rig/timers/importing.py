"""Which way of reading a file its own edges bear out, and what became of every row.

Each way is compared with falls of the protocol; the best is taken with its evidence, what no fall
decides is asked, and rows of which no edge is made are refused.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.errors import InputError
from rig.reasons import make_reason
from rig.timers.edge_rows import HEADER, is_own, read_edges
from rig.timers.events import LONGEST_S, TimerFile
from rig.timers.layouts import SETTINGS, FileReading, find_layouts, input_names, read_drops
from rig.timers.lines import read_lines
from rig.timers.problems import ProblemList, refusal
from rig.timers.timer_file import read_ways
from rig.timers.vocabulary import POWERS, form

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rig.reasons import Reason
    from rig.records import Drop

    Fit = Callable[[Sequence[Drop], bool], "FallMatch"]

_GOOD = 0.75
"""Share of the edges near a fall's, of all that came or were due, that makes a reading credible."""
_CLOSE = 0.1
_DECISIVE = 7.0
"""Logarithm of the odds beyond which a reading is taken without a question: 1,000 to 1."""
_FINALISTS = 6
_HEAD = 50
"""Lines above or at which the project's own header stands."""
_EXCESS = 4
"""Edges for each bar, twice as many as it has, beyond which several gates are on one wire: a beam
that flickers makes a few more than two."""
LONGEST_MAP = 100_000
"""Characters of a saved map; one of 200 inputs has a tenth of it."""


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
    doubts
        What falls of the protocol do not do.
    """

    share: float
    evidence: float = 0.0
    text: str = ""
    doubts: Sequence[Reason] = ()


@dataclass(frozen=True, slots=True)
class Import:
    """What is imported.

    Attributes
    ----------
    drops
        A run each.
    channels
        Of each input; of the project's own format none, for its inputs are channels.
    lines
        How the file was read, in words.
    notes
        What was assumed, a reason each.
    """

    drops: list[Drop]
    channels: Mapping[str, int]
    lines: list[str]
    notes: list[Reason]


def import_drops(gates: Sequence[int], bars: int, options: Namespace, fit: Fit) -> Import:
    """Read the drops of any timer's file.

    Parameters
    ----------
    gates
        Channels, in the order in which the gates are passed.
    bars
        Parts of the object that darken a beam, at most.
    options
        Those of ``rig import``.
    fit
        Compares drops with falls; roughly, or with the evidence that weighs readings.

    Raises
    ------
    InputError
        Every fault of the file; several readings that are as good, or none that is credible; rows
        of which no edge is made.
    """
    place = options.events
    if is_own(itertools.islice(read_lines(place), _HEAD)):
        drops = read_edges(enumerate(read_lines(place), 1), ProblemList(place))
        return Import(drops, {}, [f"the project's own format: {','.join(HEADER)}"], [])
    readings, faults, stated = list[FileReading](), list[InputError](), dict[str, Any]()
    for file in read_ways(place):
        try:
            stated = _read_stated(options, file, gates)
        except InputError as error:
            faults.append(error)
            continue
        readings += [read_drops(file, way) for way in find_layouts(file, gates, bars, stated)]
    if faults and not readings:
        raise faults[0]
    if not readings:
        pairs = ",".join(f"{name}={n}" for name, n in zip(file.labels, gates, strict=False))
        values = {"inputs": ", ".join(file.labels), "channels": ", ".join(map(str, gates))}
        raise refusal(place, "inputs_unclear", **values, pairs=pairs)
    # Parts that are a gate each may be of different days.
    lasting_s = min(reading.lasting_s for reading in readings)
    if lasting_s > LONGEST_S:
        limit = {"lasting_s": lasting_s, "limit_s": LONGEST_S}
        raise refusal(place, "too_long", recording="the recording", **limit)
    readings = [reading for reading in readings if reading.lasting_s <= LONGEST_S]
    reading, match = readings[0], FallMatch(0.0)
    if not options.as_read:
        readings = [reading for reading in readings if reading.is_whole] or readings
        reading, match = _choose(readings, place, fit, is_stated="channels" in stated)
        _refuse_excess(reading, bars, place, is_stated="groups" in stated)
    file, layout = reading.file, reading.layout
    notes = [*file.notes, _account(reading, options)]
    is_open = len([other for other in readings if other.layout.dark != "inverted"]) > 1
    if is_open or (match.share < _GOOD and not options.as_read):
        notes.append(make_reason("reading_chosen", option=str(layout), fit=match.text))
    notes += [*match.doubts, *_assumptions(reading, gates)]
    if options.map_file is not None and not Path(options.map_file).exists():
        Path(options.map_file).write_text(f"{layout.text}\n", "utf-8")
    lines = [file.kind, *(f"  {name}: {meaning}" for name, meaning in file.columns.items())]
    lines += [f"input {x} is the gate at channel {n}" for x, n in layout.channels.items() if x]
    lines += [str(layout), *([match.text] if match.text else [])]
    return Import(reading.drops, layout.channels, lines, notes)


def _choose(
    readings: Sequence[FileReading], place: str, fit: Fit, *, is_stated: bool
) -> tuple[FileReading, FallMatch]:
    """Return the reading that a fall of the protocol bears out, and how well.

    Where the user said which input is which gate, that reading, if there is no other, is taken
    whatever falls say.
    """
    distinct = {repr(reading.drops): reading for reading in reversed(readings) if reading.drops}
    if is_stated and len(distinct) == 1:
        (reading,) = distinct.values()
        return reading, fit(reading.drops, True)
    usual = reversed(distinct.values())  # the most usual first
    rough = [(fit(reading.drops, False).share, reading) for reading in usual]
    rough.sort(key=lambda row: -row[0])
    near = [reading for share, reading in rough if share >= rough[0][0] - _CLOSE][:_FINALISTS]
    # What the file says comes first: the contrary may be proposed, and is never taken.
    own = [reading for reading in near if reading.layout.dark != "inverted"]
    matches = [(fit(reading.drops, True), reading) for reading in own]
    ranked = [(match, reading) for match, reading in matches if match.share >= _GOOD]
    ranked.sort(key=lambda row: -row[0].evidence)
    (match, reading), *rest = ranked or [(FallMatch(0.0), readings[0])]
    if rest and match.evidence - rest[0][0].evidence < _DECISIVE:
        options = " or ".join(str(reading.layout) for _, reading in ranked[:2])
        raise refusal(place, "several_readings", options=options)
    if not ranked:
        says_dark = any(reading.layout.dark == "states" for reading in readings)
        good = [reading.layout for share, reading in rough if share >= _GOOD or not says_dark]
        options = "; ".join(map(str, [*good[:3], "--as-read"]))
        shares = [share for share, reading in rough if reading.layout.dark != "inverted"]
        raise refusal(place, "no_reading_fits", share=100 * max(shares, default=0), options=options)
    return reading, match


def _refuse_excess(reading: FileReading, bars: int, place: str, *, is_stated: bool) -> None:
    """Refuse what no drop does: the same again, more edges than bars, two changes at once.

    An input that has a name is no wire of all gates, unless the user stated so.
    """
    file, layout = reading.file, reading.layout
    is_wire = layout.groups == "passing" and not file.is_wide and bool(file.labels)
    if is_wire and not is_stated:
        raise refusal(place, "one_wire", option=str(layout))
    alike: dict[object, int] = {}
    for drop in reading.drops:
        earlier = alike.setdefault(drop.edges, drop.run)
        if earlier != drop.run:
            raise refusal(place, "same_twice", run=drop.run, other=earlier)
        for channel, count in Counter(edge.channel for edge in drop.edges).items():
            if count > _EXCESS * bars:
                excess = {"run": drop.run, "channel": channel, "count": count, "most": 2 * bars}
                raise refusal(place, "more_edges", **excess)
    # Of changes alone, two in a row mean that the row of the first is missing.
    changes = Counter((event.line, event.tick) for part in file.parts for event in part.events)
    line = next((line for (line, _), count in changes.items() if count > 1), 0)
    if line and file.period_s is None:  # regular samples see changes together
        raise refusal(place, "at_once", line=line)


def _account(reading: FileReading, options: Namespace) -> Reason:
    """Say what became of every row; refuse rows that are not used."""
    file = reading.file
    lines = {event.line for part in file.parts for event in part.events}
    # A level that changes may be of an input that is no gate.
    unused = sorted({*file.unread, *(() if file.is_sampled else lines - reading.lines)})
    edges = sum(len(drop.edges) for drop in reading.drops)
    counts = {"runs": len(reading.drops), "rows": file.rows, "edges": edges}
    if not unused:
        return make_reason("rows_used", silent=file.rows - len(reading.lines), **counts)
    listed = ", ".join(map(str, unused[:8])) + (" …" if len(unused) > 8 else "")
    rest = {"unused": len(unused), "lines": listed}
    if not options.allow_unused:
        raise refusal(options.events, "rows_unused", **counts, **rest)
    return make_reason("rows_left_out", **counts, **rest)


def _assumptions(reading: FileReading, gates: Sequence[int]) -> Iterator[Reason]:
    """Yield what is taken to be so, and what the file lacks."""
    file, layout, channels = reading.file, reading.layout, reading.layout.channels
    if layout.pause_s:
        drops = len(reading.drops)
        yield make_reason("several_drops", drops=drops, pause_s=layout.pause_s)
    if file.period_s:
        period_us = file.period_s * 1e6 / 10 ** POWERS.get(layout.unit, 0)
        yield make_reason("samples", period_us=period_us, u_us=period_us / math.sqrt(12.0))
    if absent := [str(n) for n in gates if n not in channels.values()]:
        yield make_reason("gates_absent", channels=", ".join(absent))
    if layout.dark in {"high", "low"}:
        opposite = {"high": "low", "low": "high"}[layout.dark]
        yield make_reason("blocked_level", level=layout.dark, other=opposite)
    idle = [label for label in file.labels if label not in channels]
    if idle and layout.groups != "passing":
        yield make_reason("inputs_unused", inputs=", ".join(idle))


def _read_stated(options: Namespace, file: TimerFile, gates: Sequence[int]) -> dict[str, Any]:
    """Return what is decided: by a saved layout, and by options, which come after it."""
    saved, channel, texts = Path(options.map_file or ""), options.channel, dict[str, str]()
    if saved.is_file():
        with saved.open(encoding="utf-8", errors="replace") as stream:
            texts[options.map_file] = stream.read(LONGEST_MAP).strip()
    texts |= {"--dark": f"dark={options.dark}"} if options.dark else {}
    texts |= {"--unit": f"unit={options.unit}"} if options.unit else {}
    if channel is not None and len(file.labels) < 2:
        texts["--channel"] = f"{next(iter(file.labels), 'input')}={channel}"
    texts |= {"--map": options.map} if options.map is not None else {}
    stated = dict[str, Any]()
    for place, text in texts.items():
        stated |= _read_map(text, place, file, gates, stated.get("groups"))
    return stated


def _read_map(
    text: str, place: str, file: TimerFile, gates: Sequence[int], groups: str | None
) -> dict[str, Any]:
    """Read what a dry run prints: settings, and the gate's channel of each input."""
    pairs = form("assigned").findall(text) or [(text, "")]
    channels, stated = dict(pairs), dict[str, Any]()
    for name in [name for name in channels if name in SETTINGS and name not in file.labels]:
        stated[name] = channels.pop(name)
        if not re.fullmatch(SETTINGS[name], stated[name]):
            raise refusal(place, "layout_unclear", text=f"{name}={stated[name]:.40}")
    inputs = {x or "input": x for x in input_names(file, stated.get("groups", groups), gates)}
    for label, channel in channels.items():
        if label not in inputs:
            raise refusal(place, "input_unknown", text=label, inputs=", ".join(inputs))
        if channel not in map(str, gates):
            accepted = f"INPUT=CHANNEL with a gate's channel: {', '.join(map(str, gates))}"
            raise refusal(place, "not_accepted", text=f"{label}={channel}", accepted=accepted)
    numbers = {inputs[label]: int(channel) for label, channel in channels.items()}
    return stated | ({"channels": numbers} if numbers else {})
