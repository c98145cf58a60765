"""Checks of recording, holding, reading and forgetting: drops in which nothing falls.

The last one needs a wire, from the sync output to a gate input.
"""

from __future__ import annotations

from statistics import fmean, stdev
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.messages import TEST_RUN, Phase, RefusalReason
from rig.selftest.board import LABEL, OTHER_LABEL, PULSE_US
from rig.selftest.verdicts import CheckFailedError, NotPossibleError

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest

_BUSY_MS = 400
_WRAP = 1 << 32


def certificate(board: BoardUnderTest) -> str:
    """See that the certificate is about what was ordered and what was sent."""
    order = board.order()
    recorded = board.drop(gates=order.gates)
    seen = recorded.certificate
    said = (seen.label, seen.gates, seen.initial_state, seen.fire_tick, seen.events, seen.crc32)
    sent = (LABEL, order.gates, 0, recorded.fired.tick, len(recorded.events), recorded.crc32)
    if said != sent:
        raise CheckFailedError(f"after {sent} it certifies {said}")
    state = board.answer(wire.Status(), wire.State)
    if (state.phase, state.label, state.events) != (Phase.HOLDING, LABEL, seen.events):
        raise CheckFailedError(f"after the drop it says {state}")
    return ""


def busy(board: BoardUnderTest) -> str:
    """See that nothing else is begun while the board records."""
    token = board.arm(record_ms=_BUSY_MS)
    fired = board.fire(token)
    state = board.answer(wire.Status(), wire.State)
    if (state.phase, state.label) != (Phase.RECORDING, LABEL):
        raise CheckFailedError(f"recording, it says {state}")
    board.refused(board.order(label=OTHER_LABEL), RefusalReason.BUSY)
    board.refused(wire.Read(LABEL, 0, 0), RefusalReason.BUSY)
    board.refused(wire.Acknowledge(LABEL, 0), RefusalReason.BUSY)
    board.refused(wire.Fire(token), RefusalReason.NOT_ARMED)
    board.ending(fired, _BUSY_MS)
    return ""


def abort_a_recording(board: BoardUnderTest) -> str:
    """See that ABORT ends a recording at once and keeps what there is."""
    fired = board.fire(board.arm(record_ms=20_000))
    board.answer(wire.Abort(), wire.Done)
    board.ending(fired)
    if board.phase() is not Phase.HOLDING:
        raise CheckFailedError("after ABORT it does not hold the drop")
    return ""


def holding(board: BoardUnderTest) -> str:
    """See that a held drop forbids arming, until it is aborted and armed anew."""
    board.drop()
    for label in (LABEL, OTHER_LABEL):
        board.refused(board.order(label=label), RefusalReason.HOLDING_A_DROP, TEST_RUN)
    board.answer(wire.Abort(), wire.Done)
    board.refused(board.order(label=OTHER_LABEL), RefusalReason.HOLDING_A_DROP, TEST_RUN)
    board.arm()
    return ""


def reading_again(board: BoardUnderTest) -> str:
    """See that a held drop reads as it was sent, and nothing beyond it."""
    recorded = board.drop()
    count = recorded.certificate.events
    again = board.answer(wire.Read(LABEL, 0, 0), wire.DropCertificate)
    if again != recorded.certificate:
        raise CheckFailedError(f"it certifies {recorded.certificate}, then {again}")
    if count:
        part = board.answer(wire.Read(LABEL, 0, 1), wire.EventsFrame)
        if part.events != recorded.events[:1]:
            raise CheckFailedError(f"it sends {recorded.events[0]}, then {part.events}")
    board.refused(wire.Read(LABEL, count, 1), RefusalReason.BAD_PARAMETER)
    board.refused(wire.Read(OTHER_LABEL, 0, 0), RefusalReason.NO_SUCH_DROP)
    return f"{count} events"


def acknowledging(board: BoardUnderTest) -> str:
    """See that only the right label and CRC-32 let a drop be forgotten."""
    recorded = board.drop()
    crc32 = recorded.certificate.crc32
    board.refused(wire.Acknowledge(LABEL, crc32 ^ 1), RefusalReason.WRONG_CRC)
    board.refused(wire.Acknowledge(OTHER_LABEL, crc32), RefusalReason.NO_SUCH_DROP)
    board.acknowledge(recorded)
    if board.phase() is not Phase.IDLE:
        raise CheckFailedError("it was acknowledged, and is not idle")
    board.refused(wire.Acknowledge(LABEL, crc32), RefusalReason.NO_SUCH_DROP)
    return ""


def cooling(board: BoardUnderTest) -> str:
    """See that a release rests after its pulse. Drives release 0."""
    if not board.options.release:
        raise NotPossibleError(f"it drives release 0 for {PULSE_US // 1000} ms: --release")
    order = board.releasing_order()
    recorded = board.ending(board.fire(board.armed_by(board.ask(order))), order.record_ms)
    board.acknowledge(recorded)
    # It must rest for 150 ms, of which a slow line takes some.
    refused = board.refused(order, RefusalReason.COOLING)
    if not 0 < refused.detail <= 3 * PULSE_US // 1000 + 1:
        raise CheckFailedError(
            f"after {PULSE_US // 1000} ms it wants to rest for {refused.detail} ms more"
        )
    board.clock.sleep(1.02e-3 * refused.detail)
    board.armed_by(board.ask(order))
    return f"{refused.detail} ms more"


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
    late = [_sync_edge(board, gate) for _ in range(board.options.drops)]
    us = [1e6 * ticks / identity.tick_hz for ticks in late]
    scatter = f"{stdev(us):.3f} µs" if len(us) > 1 else "unknown"
    said = (
        f"{len(us)} drops, latency {fmean(us):+.3f} µs, scatter {scatter}, "
        f"{min(us):+.3f} to {max(us):+.3f} µs"
    )
    if max(map(abs, late)) > identity.late_ticks:
        raise CheckFailedError(f"{said}: more than the board's own {identity.late_ticks} ticks")
    return said


def _sync_edge(board: BoardUnderTest, gate: int) -> int:
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
