"""The check that needs a wire, from the sync output to a gate input."""

from __future__ import annotations

from statistics import fmean, stdev
from typing import TYPE_CHECKING

from rig.selftest.verdicts import CheckFailedError, NotPossibleError

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest

_WRAP = 1 << 32


def sync_edges(board: BoardUnderTest) -> str:
    """See that FIRE makes the one edge of the sync output, at once, and how exactly at once.

    The output goes high with FIRE; its way back ends the recording and so is in no drop.
    """
    gate = board.options.loopback
    if gate is None:
        raise NotPossibleError("no wire from the sync output to a gate: --loopback GATE")
    identity = board.known()
    if gate >= identity.gates:
        raise NotPossibleError(f"there is no gate {gate}, they are 0 to {identity.gates - 1}")
    seen = board.gates()
    if (seen.stuck | seen.flickering) >> gate & 1:
        raise CheckFailedError(f"gate {gate} is not clear before FIRE: where does its wire go?")
    late = [_edge(board, gate) for _ in range(board.options.drops)]
    us = [1e6 * ticks / identity.tick_hz for ticks in late]
    scatter = f"{stdev(us):.3f} µs" if len(us) > 1 else "unknown"
    said = (
        f"{len(us)} drops, latency {fmean(us):+.3f} µs, scatter {scatter}, "
        f"{min(us):+.3f} to {max(us):+.3f} µs"
    )
    if max(map(abs, late)) > identity.late_ticks:
        raise CheckFailedError(f"{said}: more than the board's own {identity.late_ticks} ticks")
    return said


def _edge(board: BoardUnderTest, gate: int) -> int:
    """Fire once; give the ticks from FIRE to the edge."""
    mask = 1 << gate
    recorded = board.drop(gates=mask)
    board.acknowledge(recorded)
    states = [event.state for event in recorded.events]
    if not states:
        raise CheckFailedError(f"FIRE made no edge at gate {gate}: is the wire in place?")
    if states != [mask] or recorded.certificate.glitches:
        raise CheckFailedError(f"FIRE made {len(states)} events at gate {gate} instead of one edge")
    tick = recorded.events[0].tick - recorded.certificate.fire_tick
    return (tick + _WRAP // 2) % _WRAP - _WRAP // 2
