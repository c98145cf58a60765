"""``rig import``."""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.analysis.chain_records import chain_records
from rig.analysis.components import stated
from rig.analysis.drop import fit_drop
from rig.analysis.identify import log_evidence, most_votes
from rig.clock.calibration import TimeScale
from rig.clock.epochs import RESONATOR_TOLERANCE
from rig.clock.host import SystemClock
from rig.commands.output import say
from rig.files import require_file
from rig.protocol import reader
from rig.protocol.measurable import check_gates, check_measurable, with_gates
from rig.protocol.plan import runs
from rig.reasons import make_reason, reasons_json
from rig.session.schema import RunState
from rig.session.store import Session
from rig.timers.edges_csv import TICK_HZ, read_edges
from rig.timers.layouts import (
    GOOD,
    SETTINGS,
    FallMatch,
    check_layout,
    choose,
    find_layouts,
    part_names,
    read_drops,
    read_layout,
    save_layout,
)
from rig.timers.problems import refusal
from rig.timers.timer_file import is_edge_file, read_timer_file
from rig.units import Dimension, UnitError, parse

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Sequence

    from rig.protocol.protocol import Protocol
    from rig.reasons import Reason
    from rig.records import Drop
    from rig.timers.layouts import FileReading
    from rig.timers.timer_file import TimerFile

_COMPARED = 3
"""Drops that are compared with falls: as many as tell a way of reading from another."""
_EXCESS = 4
"""Edges for each bar, twice as many as it has, beyond which several gates are on one wire: a beam
that flickers makes a few more than two."""


def main(arguments: Namespace) -> int:
    """Make a session from an edge file."""
    if Path(arguments.events).exists():
        require_file(arguments.events)  # and no pipe: it is read more than once
    protocol = reader.read(arguments.protocol)
    source, events = Path(arguments.protocol).name, Path(arguments.events).name
    timer: dict[str, object] = {"source": "imported edges", "file": events}
    if is_edge_file(arguments.events):
        drops = read_edges(arguments.events)
        lines = ["the project's own format: run,channel,time_s,state"]
    else:
        drops, channels, lines, notes = read_with_protocol(protocol, arguments)
        timer |= {"beams": sorted(set(channels.values())), **reasons_json(notes)}
    _check_plan(protocol, drops, arguments.events)
    edges = sum(len(drop.edges) for drop in drops)
    if arguments.dry_run:
        print("\n".join([*lines, *_describe_drops(drops)]))
        return 0
    if arguments.session is None:
        raise refusal("--session", "no_session_file")
    timer["sha256"] = hashlib.sha256(Path(arguments.events).read_bytes()).hexdigest()
    if arguments.clock_uncertainty is not None:
        timer["clock_u"] = _read_share(arguments.clock_uncertainty)
    now_ns = SystemClock().now_ns()
    with Session.create(
        arguments.session, protocol.text, source, simulated=arguments.simulated, origin=events
    ) as session:
        session.add_identity(timer, now_ns)
        for drop in drops:
            session.add_drop(drop, host_ns=None, provenance=events)
            session.add_state(drop.run, drop.attempt, RunState.RECORDED, now_ns)
    runs = f"{len(drops)} run{'s' if len(drops) > 1 else ''}"
    say(f"{edges} edges of {runs} → {arguments.session}")
    return 0


def read_with_protocol(
    protocol: Protocol, arguments: Namespace
) -> tuple[list[Drop], dict[str, int], list[str], list[Reason]]:
    """Drops of another timer's file, which gate each input is, and what was assumed."""
    gates = sorted(check_gates(protocol).gates, key=lambda gate: -gate.height)
    file = read_timer_file(arguments.events, arguments.unit)
    passed = [gate.channel for gate in gates]
    bars = max(side.chain.rods for side in protocol.chains.values())
    stated = _read_stated(arguments, file, passed)
    layouts = find_layouts(file, passed, bars, stated)
    if not layouts:
        pairs = ",".join(f"{name}={n}" for name, n in zip(file.labels, passed, strict=False))
        values = {"inputs": ", ".join(file.labels), "channels": ", ".join(map(str, passed))}
        raise refusal(arguments.events, "inputs_unclear", **values, pairs=pairs)
    readings = [read_drops(file, layout) for layout in layouts[: 1 if arguments.as_read else None]]
    if arguments.as_read:
        reading, fit = readings[0], FallMatch(0.0)
    else:
        fit_drops = partial(fit_falls, protocol)
        is_stated = "channels" in stated
        reading, fit = choose(readings, arguments.events, fit_drops, is_stated=is_stated)
    if reading.layout.groups == "passing" and file.labels and "groups" not in stated:
        raise refusal(arguments.events, "one_wire", option=str(reading.layout))
    _account(file, reading, bars, arguments)
    is_open = len([other for other in readings if not other.layout.is_contrary]) > 1
    if is_open or (fit.share < GOOD and not arguments.as_read):
        file.notes.append(make_reason("reading_chosen", option=str(reading.layout), fit=fit.text))
    if pause_s := reading.layout.pause_s:
        drops = len(reading.drops)
        file.notes.append(make_reason("several_drops", drops=drops, pause_s=pause_s))
    _note_assumptions(file, reading, passed)
    channels = dict(reading.layout.channels)
    for note in file.notes:
        say(note.text)
    lines = [file.kind, *(f"  {name}: {meaning}" for name, meaning in file.columns.items())]
    lines += [f"input {label} is the gate at channel {n}" for label, n in channels.items() if label]
    lines += [str(reading.layout), *([fit.text] if fit.text else [])]
    if arguments.map_file is not None and not Path(arguments.map_file).exists():
        save_layout(reading.layout, arguments.map_file)
    return reading.drops, channels, lines, file.notes


def _note_assumptions(file: TimerFile, reading: FileReading, passed: Sequence[int]) -> None:
    """Note what is taken to be so, and what the file lacks."""
    channels = dict(reading.layout.channels)
    if file.period_s:
        period_us = file.period_s * 1e6
        u_us = period_us / math.sqrt(12.0)
        file.notes.append(make_reason("samples", period_us=period_us, u_us=u_us))
    absent = [str(n) for n in passed if n not in channels.values()]
    if absent:
        file.notes.append(make_reason("gates_absent", channels=", ".join(absent)))
    if reading.layout.dark in {"high", "low"}:
        other = "low" if reading.layout.dark == "high" else "high"
        file.notes.append(make_reason("blocked_level", level=reading.layout.dark, other=other))
    idle = [label for label in file.labels if label not in channels]
    if idle and reading.layout.groups != "passing":
        file.notes.append(make_reason("inputs_unused", inputs=", ".join(idle)))


def _account(file: TimerFile, reading: FileReading, bars: int, arguments: Namespace) -> None:
    """Say what became of every row; refuse rows that are not used, and what cannot be."""
    alike: dict[object, int] = {}
    for drop in reading.drops:
        other = alike.setdefault(drop.edges, drop.run)
        if other != drop.run and not arguments.as_read:
            raise refusal(arguments.events, "same_twice", run=drop.run, other=other)
        for channel, count in Counter(edge.channel for edge in drop.edges).items():
            if count > _EXCESS * bars and not arguments.as_read:
                excess = {"run": drop.run, "channel": channel, "count": count, "most": 2 * bars}
                raise refusal(arguments.events, "more_edges", **excess)
    # Of changes alone, two in a row mean that the row of the first is missing.
    changes = Counter((p.line, p.tick) for group in file.groups for p in group.passages)
    together = next((line for (line, _), count in changes.items() if count > 1), 0)
    if together and not file.period_s and not arguments.as_read:
        raise refusal(arguments.events, "at_once", line=together)
    unused = sorted(set(file.rows) - reading.lines - file.silent)
    edges = sum(len(drop.edges) for drop in reading.drops)
    counts = {"runs": len(reading.drops), "rows": len(file.rows), "edges": edges}
    if not unused:
        silent = len(file.silent - reading.lines)
        file.notes.append(make_reason("rows_used", silent=silent, **counts))
        return
    listed = ", ".join(map(str, unused[:8])) + (" …" if len(unused) > 8 else "")
    left = {"unused": len(unused), "lines": listed}
    if not arguments.allow_unused:
        raise refusal(arguments.events, "rows_unused", **counts, **left)
    file.notes.append(make_reason("rows_left_out", **counts, **left))


def fit_falls(protocol: Protocol, drops: Sequence[Drop], exact: bool) -> FallMatch:
    """Compare the first drops with falls that the protocol has."""
    planned = {run.number: run for run in runs(protocol)}
    # Of gates that the file does not have nothing is due.
    protocol = with_gates(protocol, {edge.channel for drop in drops for edge in drop.edges})
    shares, near, expected = [1.0], 0, 0
    evidence, gravity = 0.0, list[float]()
    rate = TimeScale(TICK_HZ, RESONATOR_TOLERANCE)
    for drop in [drop for drop in drops if drop.run in planned][: None if exact else _COMPARED]:
        run = planned[drop.run]
        records = chain_records(protocol, run, drop, TICK_HZ)
        votes = sum(most_votes(protocol, record, rate.u, stated(protocol)) for record in records)
        due = sum(record.expected for record in records)
        shares.append(votes / max(1, len(drop.edges), due))
        near, expected = near + min(votes, due), expected + due
        if exact and len(gravity) < _COMPARED:
            result, fit = fit_drop(protocol, run, drop, rate, explain=False)
            evidence += log_evidence(fit) if fit else 0.0
            gravity += [each.value for name, each in result.quantities.items() if "gravity" in name]
    text = make_reason("falls_fit", runs=len(drops), near=near, due=expected).text
    if gravity:
        text += f"; g {sum(gravity) / len(gravity):.2f} m/s²"
    return FallMatch(min(shares), evidence, text)


def _describe_drops(drops: Sequence[Drop]) -> Iterator[str]:
    """Describe what would be imported, a line a run."""
    for drop in drops:
        by_channel = Counter(edge.channel for edge in drop.edges)
        counts = ", ".join(f"{channel}: {n}" for channel, n in sorted(by_channel.items()))
        span = (drop.edges[-1].tick - drop.edges[0].tick) / drop.tick_hz
        yield f"run {drop.run}: {len(drop.edges)} edges in {span:.4g} s; by channel {counts}"


def _read_stated(arguments: Namespace, file: TimerFile, gates: Sequence[int]) -> dict[str, Any]:
    """Return what is decided by a saved layout and by options, which come before it."""
    stated: dict[str, Any] = {}
    if arguments.map_file is not None and Path(arguments.map_file).exists():
        stated |= read_layout(arguments.map_file)
    options = {"unit": None if file.has_unit else arguments.unit, "dark": arguments.dark}
    stated |= {name: value for name, value in options.items() if value is not None}
    if arguments.map is not None:
        settings, pairs = _part_settings(arguments.map, file)
        stated |= check_layout(settings, "--map")
        labels = list(file.labels) or ["input"]
        if stated.get("groups") == "gates":
            labels = part_names(file)
        elif stated.get("groups") == "passing":
            labels = [f"gate {n}" for n in range(1, len(gates) + 1)]
        if pairs or not settings:
            chosen = _read_pairs(pairs, labels, gates)
            bare = labels == ["input"]
            stated["channels"] = {"" if bare else label: n for label, n in chosen.items()}
    elif arguments.channel is not None and len(file.labels) < 2:
        if arguments.channel not in gates:
            accepted = f"a gate's channel: {', '.join(map(str, gates))}"
            raise refusal(
                "--channel", "not_accepted", text=str(arguments.channel), accepted=accepted
            )
        stated["channels"] = {next(iter(file.labels), ""): arguments.channel}
    return stated


def _part_settings(text: str, file: TimerFile) -> tuple[dict[str, object], str]:
    """Part what decides how a file is read from the pairs of inputs and channels."""
    settings: dict[str, object] = {}
    pairs = []
    for part in text.split(","):
        name, _, value = part.partition("=")
        if name.strip() in SETTINGS and name.strip() not in file.labels:
            number = name.strip() == "pause_s" and re.fullmatch(r"[0-9.]{1,20}", value)
            settings[name.strip()] = float(value) if number else value.strip()
        else:
            pairs.append(part)
    return settings, ",".join(pairs)


def _read_pairs(text: str, labels: Sequence[str], gates: Sequence[int]) -> dict[str, int]:
    channels = {}
    pairs = re.findall(r"\s*([^=]+?)\s*(?:=\s*([^\s,=]*)[\s,]*|$)", text) or [(text, "")]
    for label, channel in pairs:
        if label not in labels:
            accepted = f"an input of the file: {', '.join(labels)}"
            raise refusal("--map", "not_accepted", text=label, accepted=accepted)
        if not channel.isdecimal() or int(channel) not in gates:
            accepted = f"INPUT=CHANNEL with a gate's channel: {', '.join(map(str, gates))}"
            raise refusal("--map", "not_accepted", text=f"{label}={channel}", accepted=accepted)
        channels[label] = int(channel)
    return channels


def _read_share(text: str) -> float:
    try:
        value = parse(text, Dimension.NUMBER).value
    except UnitError:
        value = math.nan
    if not 0.0 <= value < 0.1:
        accepted = "a share from 0 to 10 %, as in 50 ppm"
        raise refusal("--clock-uncertainty", "not_accepted", text=text, accepted=accepted)
    return value


def _check_plan(protocol: Protocol, drops: Sequence[Drop], source: str) -> None:
    """Refuse runs that are not planned; remark on channels that are not gates."""
    gates = check_gates(protocol)
    check_measurable(protocol)
    planned = len(runs(protocol))
    strangers = sorted({drop.run for drop in drops if drop.run > planned})
    if strangers:
        values = {"run": strangers[0], "protocol": protocol.source, "planned": planned}
        raise refusal(source, "run_unplanned", **values)
    used = gates.mask
    idle = sorted({e.channel for drop in drops for e in drop.edges if not used >> e.channel & 1})
    if idle:
        say(make_reason("channels_unused", channels=", ".join(map(str, idle))).text)
