"""``rig import``."""

import hashlib
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rig.analysis.chain_records import chain_records
from rig.analysis.drop import DropCase
from rig.analysis.gravity import check_gravity
from rig.analysis.identify import side_fall
from rig.analysis.result import DropResult
from rig.clock.calibration import TimeScale
from rig.clock.epochs import RESONATOR_TOLERANCE
from rig.clock.host import SystemClock
from rig.commands.output import Arguments, say
from rig.protocol import reader
from rig.protocol.measurable import check_measurable, with_channels
from rig.protocol.protocol import Protocol
from rig.reasons import make_reason, reasons_json
from rig.records import Drop
from rig.report.numbers import plus_minus
from rig.report.templates import lines
from rig.session.schema import RunState
from rig.session.store import Session
from rig.timers.importing import FallMatch, Import, import_drops
from rig.timers.layouts import FileReading
from rig.timers.moments import TICK_HZ
from rig.timers.problems import refusal

_COMPARED = 3
"""Drops that are compared with falls: as many as tell a way of reading from another."""
_MOST = 120
"""Drops of a long session that are compared: evenly in the order of how many edges they have, then
of how long they last, so that those that are least like the others are among them."""


def main(arguments: Arguments) -> None:
    """Make a session from a file, or say how it would be read."""
    protocol = reader.read(arguments.protocol)
    check_measurable(protocol)
    source, events = Path(arguments.protocol).name, Path(arguments.events).name
    imported = import_with_protocol(protocol, arguments)
    drops = imported.drops
    _check_plan(protocol, drops, arguments.events)
    for note in imported.notes:
        say(note.text)
    if arguments.dry_run:
        print("\n".join([*imported.lines, *lines("imported", drops)]))
        return
    if arguments.session is None:
        raise refusal("--session", "no_session_file")
    timer: dict[str, object] = {"source": "imported edges", "file": events}
    if imported.channels:
        timer |= {"beams": sorted({*imported.channels.values()}), **reasons_json(imported.notes)}
    timer["sha256"] = hashlib.sha256(Path(arguments.events).read_bytes()).hexdigest()
    if arguments.clock_uncertainty is not None:
        timer["clock_u"] = arguments.clock_uncertainty
    now_ns = SystemClock().now_ns()
    with Session.create(
        arguments.session, protocol.text, source, simulated=arguments.simulated, origin=events
    ) as session:
        session.add_identity(timer, now_ns)
        for drop in drops:
            session.add_drop(drop, host_ns=None, provenance=events)
            session.add_state(drop.run, drop.attempt, RunState.RECORDED, now_ns)
    counted = f"{len(drops)} run{'s' if len(drops) > 1 else ''}"
    say(f"{sum(len(drop.edges) for drop in drops)} edges of {counted} → {arguments.session}")


def import_with_protocol(protocol: Protocol, arguments: Arguments) -> Import:
    """Read the drops of any timer's file as a protocol's falls bear them out."""
    gates = sorted(protocol.gates.gates, key=lambda gate: -gate.height)
    bars = max(side.chain.rods for side in protocol.chains.values())
    channels = [gate.channel for gate in gates]
    return import_drops(channels, bars, arguments, partial(fit_falls, protocol))


def fit_falls(protocol: Protocol, reading: FileReading, exact: bool) -> FallMatch:
    """Compare the first drops with falls that the protocol has."""
    planned = {run.number: run for run in protocol.runs()}
    # Of gates that the file does not have nothing is due.
    protocol = with_channels(protocol, {*reading.edges.channel.tolist()})
    near, expected, evidence = 0, 0, 0.0
    shares, results = [(1.0, 0)], list[DropResult]()
    rate = TimeScale(TICK_HZ, RESONATOR_TOLERANCE)
    most = None if exact else _COMPARED
    compared = [n for n in reading.runs if n in planned][:most]
    order = sorted(compared, key=lambda n: (len(reading.runs[n]), reading.lasting[n]))
    for n in sorted({*order[:: 1 + len(order) // _MOST], *order[-1:]}):
        run, drop = planned[n], reading.drop(n)
        records = chain_records(protocol.of(run), run, drop, TICK_HZ)
        matched = sum(side_fall(protocol.of(run), x, rate.u).most_matches() for x in records)
        due = sum(record.edge_count for record in records)
        # A single edge is near one of some fall, whenever that began.
        shares.append((matched / max(2, len(drop.edges), due), n))
        near, expected = near + matched, expected + due
        if exact and len(results) < _COMPARED:
            result, fit = DropCase(protocol, run, drop, rate).read(explain=False)
            evidence += fit.evidence if fit else 0.0
            results.append(result)
    sums = {"compared": len(shares) - 1, "runs": len(compared), "near": near, "due": expected}
    text = make_reason("falls_fit", **sums).text
    check = check_gravity(protocol, results)
    text += f"; g {plus_minus(check.measured)} m/s²" if check else ""
    doubts = check.doubts if check else [x for result in results[:1] for x in result.reasons]
    return FallMatch(*min(shares), evidence, text, doubts)


def _check_plan(protocol: Protocol, drops: Sequence[Drop], source: str) -> None:
    """Refuse runs that are not planned; remark on channels that are not gates."""
    planned = len(protocol.runs())
    if run := min((drop.run for drop in drops if drop.run > planned), default=0):
        raise refusal(source, "run_not_planned", run=run, planned=planned)
    used = {edge.channel for drop in drops for edge in drop.edges}
    if idle := sorted(used - {gate.channel for gate in protocol.gates.gates}):
        say(make_reason("channels_unused", channels=", ".join(map(str, idle))).text)
