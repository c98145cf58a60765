"""``rig import``."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

from rig.clock.host import SystemClock
from rig.commands.output import say
from rig.errors import InputError
from rig.protocol import reader
from rig.protocol.measurable import check_measurable
from rig.protocol.plan import runs
from rig.session.edges_csv import read_edges
from rig.session.schema import RunState
from rig.session.store import Session
from rig.session.timer_csv import read_timer
from rig.session.timer_table import is_logger_table
from rig.units import Dimension, UnitError, parse

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Sequence

    from rig.protocol.protocol import Gate, Protocol
    from rig.records import Drop


def main(arguments: Namespace) -> int:
    """Make a session from an edge file."""
    protocol = reader.read(arguments.protocol)
    exported = is_logger_table(arguments.events)
    if exported:
        gate, bars = _beam(protocol, arguments.channel)
        drops = read_timer(arguments.events, gate.channel, bars)
    else:
        drops = read_edges(arguments.events)
    _fits(protocol, drops, arguments.events)
    timer: dict[str, object] = {
        "source": "imported edges",
        "file": Path(arguments.events).name,
        "sha256": hashlib.sha256(Path(arguments.events).read_bytes()).hexdigest(),
    }
    if exported:
        timer["beams"] = [gate.channel]
    if arguments.clock_uncertainty is not None:
        timer["clock_u"] = _relative(arguments.clock_uncertainty)
    now_ns = SystemClock().now_ns()
    with Session.create(
        arguments.session,
        protocol.text,
        Path(arguments.protocol).name,
        simulated=arguments.simulated,
        origin=Path(arguments.events).name,
    ) as session:
        session.add_identity(timer, now_ns)
        for drop in drops:
            session.add_drop(drop, host_ns=None, provenance=Path(arguments.events).name)
            session.add_state(drop.run, drop.attempt, RunState.RECORDED, now_ns)
    edges = sum(len(drop.edges) for drop in drops)
    say(f"{edges} edges of {len(drops)} runs → {arguments.session}")
    return 0


def _beam(protocol: Protocol, channel: int | None) -> tuple[Gate, int]:
    """Which gate a data logger's beam was, and how many rods or bars pass it."""
    gates = protocol.gates.gates if protocol.gates else ()
    named = [gate for gate in gates if channel is None or gate.channel == channel]
    if len(named) == 1:
        return named[0], max(one.chain.rods for one in protocol.chains.values())
    known = ", ".join(f"{gate.channel} at {gate.height * 1e3:g} mm" for gate in gates)
    wrong = "the file does not say which gate its times are of"
    if channel is not None:
        wrong = f"there is no gate at channel {channel}"
    raise InputError(
        f"{protocol.source}: {wrong}",
        f"say which with --channel N: {known}" if known else "add the gate they are of",
    )


def _relative(text: str) -> float:
    try:
        value = parse(text, Dimension.NUMBER).value
    except UnitError as error:
        raise InputError(f"--clock-uncertainty: {error}") from None
    if not 0.0 <= value < 0.1:
        raise InputError(
            f"--clock-uncertainty: {text} is out of range", "0 to 10 % is accepted, as in 50 ppm"
        )
    return value


def _fits(protocol: Protocol, drops: Sequence[Drop], source: str) -> None:
    """Refuse runs that are not planned; remark on channels that are not gates."""
    if protocol.gates is None:
        raise InputError(
            f"{protocol.source} has no gates, so edges cannot belong to it",
            "add the gates the edges come from",
        )
    check_measurable(protocol)
    planned = len(runs(protocol))
    strangers = sorted({drop.run for drop in drops if drop.run > planned})
    if strangers:
        raise InputError(
            f"{source}: run {strangers[0]} is not in the plan of {protocol.source}, which has "
            f"{planned} runs",
            "raise plan.repeats, or number the runs as the plan does",
        )
    used = protocol.gates.mask
    idle = sorted({e.channel for drop in drops for e in drop.edges if not used >> e.channel & 1})
    if idle:
        say(f"edges of channels {', '.join(map(str, idle))} are kept but belong to no gate")
