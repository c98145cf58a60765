"""Which way of reading a file its own edges bear out, and what became of every row.

Each way is compared with falls of the protocol; the best is taken with its evidence, what no fall
decides is asked, and rows of which no edge is made are refused.
"""

import itertools
import re
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rig.errors import InputError
from rig.reasons import Reason, make_reason
from rig.records import Drop
from rig.timers.edge_rows import HEADER, is_own, read_edges
from rig.timers.layouts import SETTINGS, FileReading, find_layouts, input_names
from rig.timers.lines import read_lines
from rig.timers.moments import LONGEST_DROP, TICK_HZ
from rig.timers.problems import refusal
from rig.timers.signals import read_file
from rig.timers.timer_file import TimerFile
from rig.timers.vocabulary import POWERS, SYMBOLS, form

Fit = Callable[[FileReading, bool], "FallMatch"]

_DECISIVE = 7.0
"""Logarithm of the odds beyond which a reading is taken without a question: 1,000 to 1."""
_FINALISTS = 6
_COARSE = 10**8
"""Picoseconds: times in whole tenths of milliseconds may be those of two falls by chance."""
_FEWEST_SAME = 3
"""Edges at the same times: the first may be 0 in every run, and a second by chance."""
_MOST_WAYS = 64
_HEAD = 50
"""Lines above or at which the project's own header stands."""


class FallMatch(NamedTuple):
    """How well drops are like falls of the protocol.

    Attributes
    ----------
    share
        Edges near a fall's, of all that came or were due, from 0 to 1, in the worst run.
    worst
        Which run that is; 0 if none was compared.
    evidence
        Logarithm of the marginal likelihood; 0 if not asked for.
    text
        What a user can check.
    doubts
        What falls of the protocol do not do.
    """

    share: float = 0.0
    worst: int = 0
    evidence: float = 0.0
    text: str = ""
    doubts: Sequence[Reason] = ()


class Import(NamedTuple):
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
        for name in "map", "map-file", "channel", "dark", "unit":
            if getattr(options, name.replace("-", "_")) is not None:
                raise refusal(f"--{name}", "own_format_stated")
        return Import(read_edges(place), {}, [f"the project's own format: {','.join(HEADER)}"], [])
    readings = _find_readings(options, gates, bars)
    reading, match = readings[0], FallMatch()
    if not options.as_read:
        reading, match = _choose(readings, place, fit)
        _refuse_impossible(reading, place)
    file, channels = reading.file, reading.layout.channels
    notes = [*file.notes, _account(reading, options), *_assumptions(reading, match.text, gates)]
    notes += match.doubts
    if options.map_file and not Path(options.map_file).exists():
        Path(options.map_file).write_text(f"{reading.layout.text}\n", "utf-8")
    lines = [
        *file.lines,
        *(f"input {x} is the gate at channel {n}" for x, n in channels.items() if x),
        str(reading.layout),
        *filter(None, [match.text]),
    ]
    return Import([*map(reading.drop, reading.runs)], channels, lines, notes)


def _find_readings(options: Namespace, gates: Sequence[int], bars: int) -> list[FileReading]:
    """Return every reading of a file that has drops."""
    readings, faults = list[FileReading](), list[InputError]()
    for way in itertools.count():
        file = TimerFile(options.events, way)
        try:
            read_file(file)
            file.stated = _read_stated(options, file, gates)
            every = (FileReading(file, layout) for layout in find_layouts(file, gates, bars))
            readings += [reading for reading in every if reading.runs]
        except InputError as error:
            faults.append(error)
        if way + 1 >= min(file.ways, _MOST_WAYS):
            break
    if not readings:
        if faults:
            raise faults[0]
        if not file.labels:
            raise refusal(options.events, "edges_few", edges=len(file.changes))
        pairs = ",".join(map("{}={}".format, file.labels, gates))
        values = {"inputs": ", ".join(file.labels), "channels": ", ".join(map(str, gates))}
        raise refusal(options.events, "inputs_unclear", **values, pairs=pairs)
    short = [reading for reading in readings if reading.longest <= LONGEST_DROP]
    if not short:
        last = readings[-1]  # in the smallest unit that the file may mean
        limit = {"lasting_s": last.longest / TICK_HZ, "limit_s": LONGEST_DROP / TICK_HZ}
        last.file.problems.refuse(last.edges.line[-1], "too_long", **limit)
    return short


def _choose(readings: Sequence[FileReading], place: str, fit: Fit) -> tuple[FileReading, FallMatch]:
    """Return the reading that a fall of the protocol bears out, and how well.

    Where the user said which input is which gate, that reading, if there is no other, is taken
    whatever falls say. Of others a drop has to be identified, which is the evidence. What
    contradicts the file is taken only where nothing else fits nearly as well.
    """
    edge = ["run", "tick", "channel", "blocked"]
    distinct = [*{hash(str(x.edges[edge].tolist())): x for x in readings[::-1]}.values()][::-1]
    usual = [x for x in distinct if x.is_whole and "thousands" not in x.file.facts] or distinct
    if len(usual) == 1 and "channels" in usual[0].file.stated:
        return usual[0], fit(usual[0], True)
    matches = {x: fit(x, False) for x in distinct}
    rough = sorted(distinct, key=lambda x: -matches[x].share)
    likely = [x for x in rough if matches[x].share >= x.least_share][:_FINALISTS]
    matches |= {x: fit(x, True) for x in likely}
    ranked = [x for x in likely if matches[x].evidence and matches[x].share >= x.least_share]
    ranked.sort(key=lambda x: _DECISIVE * x.oddities - matches[x].evidence)
    if not ranked:
        best = rough[0]
        proposed = list(dict.fromkeys(str(x.layout) for x in rough if not x.oddities))[:3]
        run, options = matches[best].worst or min(best.runs), "; ".join([*proposed, "--as-read"])
        values = {"share": 100 * matches[best].share, "run": run, "options": options}
        best.file.problems.refuse(best.runs[run].line.min(), "no_reading_fits", **values)
    best = ranked[0]
    rivals = [x for x in ranked if x.oddities == best.oddities][1:2]
    if any(matches[best].evidence - matches[x].evidence < _DECISIVE for x in rivals):
        raise refusal(place, "several_readings", options=f"{best.layout} or {rivals[0].layout}")
    return best, matches[best]


def _refuse_impossible(reading: FileReading, place: str) -> None:
    """Refuse what no drop does: the same again, or two changes at once."""
    earlier: dict[object, int] = {}
    for run, edges in reading.runs.items():
        drop, lines = reading.drop(run), tuple(edges.line.tolist())
        # Of coarse times those of a whole drop are a copy's; of fine ones, rows may be missing.
        is_coarse = all(edge.tick % _COARSE == 0 for edge in drop.edges)
        moments: set[object] = {drop.edges} if is_coarse else {*drop.edges}
        if reading.layout.pause_s and lines in earlier:  # a column of another clock
            moments = {lines}
        same = Counter(earlier[moment] for moment in moments & earlier.keys())
        for other, count in same.most_common(1):
            if count >= min(len(moments), max(_FEWEST_SAME, 1 + len(moments) // 2)):
                raise refusal(place, "same_twice", run=run, other=other)
        earlier |= dict.fromkeys((lines, *moments), run)
    # Of changes alone, two in a row mean that the row of the first is missing.
    cells = Counter(reading.edges[["line", "tick", "clock"]].tolist())
    again = [line for (line, *_), count in cells.items() if count > 1]
    if again and reading.file.period is None:  # regular samples see changes together
        raise refusal(place, "at_once", lines=_some(again))


def _account(reading: FileReading, options: Namespace) -> Reason:
    """Say what became of every row; refuse rows that are not used."""
    file, edges = reading.file, Counter(reading.edges.line.tolist())
    # A level that changes may be of an input that is no gate.
    is_change = ~file.changes.first & ("sampled" not in file.facts)
    left = Counter(file.changes.line[is_change].tolist()) - edges - Counter(reading.states)
    unused = sorted({*file.unread, *left})
    counts = {"runs": len(reading.runs), "rows": file.rows, "edges": edges.total()}
    if not unused:
        return make_reason("rows_used", silent=file.rows - len(edges), **counts)
    rest = {"unused": len(unused), "lines": _some(unused)}
    if not options.allow_unused:
        raise refusal(options.events, "rows_unused", **counts, **rest)
    return make_reason("rows_left_out", **counts, **rest)


def _some(lines: Sequence[int]) -> str:
    return ", ".join(map(str, lines[:8])) + (" …" if len(lines) > 8 else "")


def _assumptions(reading: FileReading, fit: str, gates: Sequence[int]) -> list[Reason]:
    """Return what is taken to be so, and what the file lacks."""
    file, layout = reading.file, reading.layout
    dark, pause_s, firsts = layout.dark, layout.pause_s, ", ".join(reading.firsts)
    renamed = ", ".join(f"{name} is run {n}" for name, n in reading.renamed.items())
    period_us = (file.period or 0) / 10 ** POWERS[layout.unit or "s"] / 1e6
    absent = ", ".join(str(n) for n in gates if n not in layout.channels.values())
    opposite = {"high": "low", "low": "high"}.get(dark)
    idle = ", ".join(label for label in file.labels if label not in layout.channels)
    rows: list[tuple[object, str, dict[str, object]]] = [
        (fit, "reading_chosen", {"option": str(layout), "fit": fit}),
        (renamed and file.changes.run.any(), "runs_renamed", {"runs": renamed}),
        ("thousands" in file.facts, "thousands_parted", {}),
        (pause_s, "several_drops", {"drops": len(reading.runs), "pause_s": pause_s}),
        (period_us, "samples", {"period_us": period_us, "u_us": period_us / 12.0**0.5}),
        (absent, "gates_absent", {"channels": absent}),
        (opposite, "blocked_level", {"level": dark, "other": opposite}),
        (dark == "inverted", "states_inverted", {}),
        (firsts and layout.first == "state", "first_unknown", {"input": firsts}),
        (firsts and layout.first == "change", "first_row", {"input": firsts}),
        (idle and layout.groups != "passing", "inputs_unused", {"inputs": idle}),
    ]
    return [make_reason(code, **values) for is_so, code, values in rows if is_so]


def _read_stated(options: Namespace, file: TimerFile, gates: Sequence[int]) -> dict[str, Any]:
    """Return what is decided: by a saved layout, and by options, which come after it.

    Each is what a dry run prints: settings, and the gate's channel of each input.
    """
    saved, labels = Path(options.map_file or ""), file.labels or [""]
    if options.channel is not None and len(labels) > 1:
        raise refusal("--channel", "inputs_several", inputs=", ".join(labels))
    begins = {"dark": "dark=", "unit": "unit=", "channel": f"{labels[0] or 'input'}=", "map": ""}
    texts = {options.map_file: next(read_lines(saved), "")} if saved.is_file() else {}
    values = {name: getattr(options, name) for name in begins}
    texts |= {f"--{x}": f"{begins[x]}{value}" for x, value in values.items() if value is not None}
    pairs = form("assigned").findall
    rows = [(x, *y) for x, text in texts.items() for y in pairs(text) or [(text, "")]]
    settings = {*SETTINGS}.difference(labels)
    stated: dict[str, Any] = {name: value for _, name, value in rows if name in settings}
    inputs = {x or "input": x for x in input_names(file, stated.get("groups"), gates)}
    accepted = f"INPUT=CHANNEL with a gate's channel: {', '.join(map(str, gates))}"
    channels = dict[str, int]()
    for place, name, value in rows:
        if name in inputs:
            if value not in map(str, gates):
                raise refusal(place, "not_accepted", text=f"{name}={value}", accepted=accepted)
            channels[inputs[name]] = int(value)
        elif name not in settings:
            raise refusal(place, "input_unknown", text=name, inputs=", ".join(inputs))
        elif not re.fullmatch(SETTINGS[name], value):
            raise refusal(place, "layout_unclear", text=f"{name}={value:.40}")
        elif name == "unit" and {None, POWERS[value]}.isdisjoint(file.powers):
            units = " and ".join(sorted(SYMBOLS[power] for power in file.powers)) or "s"
            raise refusal(place, "unit_contradicts", unit=value, units=units)
    return stated | ({"channels": channels} if channels else {})
