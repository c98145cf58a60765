"""``rig import``."""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from rig.clock.host import SystemClock
from rig.commands.output import say
from rig.files import require_file
from rig.protocol import reader
from rig.protocol.measurable import check_gates, check_measurable
from rig.protocol.plan import runs
from rig.reasons import make_reason, reasons_json
from rig.session.schema import RunState
from rig.session.store import Session
from rig.timers.edges_csv import read_edges
from rig.timers.problems import refusal
from rig.timers.timer_file import drops_of, is_edge_file, label_number, read_timer_file
from rig.units import Dimension, UnitError, parse

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Sequence

    from rig.protocol.protocol import Gate, Protocol
    from rig.reasons import Reason
    from rig.records import Drop
    from rig.timers.timer_file import TimerFile


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
        drops, channels, lines, notes = _read_timer_file(protocol, arguments)
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


def _read_timer_file(
    protocol: Protocol, arguments: Namespace
) -> tuple[list[Drop], dict[str, int], list[str], list[Reason]]:
    """Drops of another timer's file, which gate each input is, and what was assumed."""
    file = read_timer_file(arguments.events, arguments.unit)
    channels = _match_inputs(protocol, file, arguments)
    bars = max(side.chain.rods for side in protocol.chains.values())
    drops = drops_of(file, channels, bars, arguments.dark)
    lines = [file.kind, *(f"  {name}: {meaning}" for name, meaning in file.columns.items())]
    if file.period_s:
        period_us = file.period_s * 1e6
        u_us = period_us / math.sqrt(12.0)
        file.notes.append(make_reason("samples", period_us=period_us, u_us=u_us))
    idle = [label for label in file.labels if label not in channels]
    if idle:
        file.notes.append(make_reason("inputs_unused", inputs=", ".join(idle)))
    for note in file.notes:
        say(note.text)
    lines += [f"input {label} is the gate at channel {n}" for label, n in channels.items() if label]
    return drops, channels, lines, file.notes


def _describe_drops(drops: Sequence[Drop]) -> Iterator[str]:
    """Describe what would be imported, a line a run."""
    for drop in drops:
        by_channel = Counter(edge.channel for edge in drop.edges)
        counts = ", ".join(f"{channel}: {n}" for channel, n in sorted(by_channel.items()))
        span = (drop.edges[-1].tick - drop.edges[0].tick) / drop.tick_hz
        yield f"run {drop.run}: {len(drop.edges)} edges in {span:.4g} s; by channel {counts}"


def _match_inputs(protocol: Protocol, file: TimerFile, arguments: Namespace) -> dict[str, int]:
    """Which gate each of the file's inputs is."""
    gates = [gate.channel for gate in protocol.gates.gates] if protocol.gates else []
    labels = file.labels
    if not labels:
        return {"": _find_gate(protocol, arguments.channel).channel}
    if arguments.map is not None:
        return _read_pairs(arguments.map, labels, gates)
    if len(labels) == 1 and (arguments.channel is not None or len(gates) == 1):
        return {labels[0]: _find_gate(protocol, arguments.channel).channel}
    channels = {name: n for name in labels if (n := label_number(name)) in gates and n is not None}
    # As many inputs as gates, and not all of the same number: counted from 1, perhaps.
    shifted = len(labels) == len(gates) and len(channels) < len(labels)
    if not channels or shifted or len(set(channels.values())) < len(channels):
        pairs = ",".join(f"{name}={n}" for name, n in zip(labels, gates, strict=False))
        values = {"inputs": ", ".join(labels), "channels": ", ".join(map(str, gates))}
        raise refusal(arguments.events, "inputs_unclear", **values, pairs=pairs)
    return channels


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


def _find_gate(protocol: Protocol, channel: int | None) -> Gate:
    """Which gate the beam of a file was that has only one."""
    gates = protocol.gates.gates if protocol.gates else ()
    candidates = [gate for gate in gates if channel is None or gate.channel == channel]
    if len(candidates) == 1:
        return candidates[0]
    channels = ", ".join(f"{gate.channel} at {gate.height * 1e3:g} mm" for gate in gates)
    if channel is None:
        raise refusal(protocol.source, "which_gate", channels=channels)
    accepted = f"a gate's channel: {channels}"
    raise refusal("--channel", "not_accepted", text=str(channel), accepted=accepted)


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
