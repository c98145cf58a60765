"""Checks of recording, holding, reading and forgetting: drops in which nothing falls.

The last one needs a wire, from the sync output to a gate input.
"""

from __future__ import annotations

import zlib
from statistics import fmean, stdev

from rig.link import messages as wire
from rig.link.assembly import ticks_since
from rig.link.messages import TEST_RUN, Phase, RefusalReason
from rig.selftest.board import LABEL, OTHER_LABEL, PULSE_US, BoardUnderTest
from rig.selftest.findings import fail_if, insist, need, wrong_answer

_BUSY_MS = 400


def compare_certificate(board: BoardUnderTest) -> None:
    """See that the certificate is about what was ordered and what was sent."""
    gate = board.quiet_gate()
    fired = board.fire(board.arm(gates=gate))
    recorded = board.collect_drop()
    seal, events = recorded.certificate, len(recorded.events)
    certified = (seal.label, seal.gates, seal.initial_state, seal.fire_tick, seal.events)
    sent = (LABEL, gate, 0, fired.tick, events)
    crc32 = zlib.crc32(wire.pack_events(recorded.events))
    insist("the certificate of a drop", (*certified, seal.crc32), (*sent, crc32))
    board.insist_state("a drop", phase=Phase.HOLDING, label=LABEL, events=events)


def ask_while_recording(board: BoardUnderTest) -> None:
    """See that nothing else is begun while the board records."""
    token = board.arm(record_ms=_BUSY_MS)
    board.fire(token)
    board.insist_state("Fire", phase=Phase.RECORDING, label=LABEL)
    board.refuse(board.order(label=OTHER_LABEL), RefusalReason.BUSY)
    board.refuse(wire.Read(LABEL, 0, 0), RefusalReason.BUSY)
    board.refuse(wire.Acknowledge(LABEL, 0), RefusalReason.BUSY)
    board.refuse(wire.Fire(token), RefusalReason.NOT_ARMED)
    board.collect_drop(_BUSY_MS)


def abort_a_recording(board: BoardUnderTest) -> None:
    """See that ABORT ends a recording at once and keeps what there is."""
    board.fire(board.arm(record_ms=20_000))
    board.abort()
    board.collect_drop()
    board.insist_state("Abort", phase=Phase.HOLDING)


def arm_while_holding(board: BoardUnderTest) -> None:
    """See that a held drop forbids arming, until it is aborted and armed anew."""
    board.drop()
    for label in (LABEL, OTHER_LABEL):
        board.refuse(board.order(label=label), RefusalReason.HOLDING_A_DROP, TEST_RUN)
    board.abort()
    board.refuse(board.order(label=OTHER_LABEL), RefusalReason.HOLDING_A_DROP, TEST_RUN)
    board.arm()


def read_again(board: BoardUnderTest) -> str:
    """See that a held drop reads as it was sent, and nothing beyond it."""
    recorded = board.drop()
    count = recorded.certificate.events
    again = board.answer(wire.Read(LABEL, 0, 0), wire.DropCertificate)
    insist("Read", again, recorded.certificate)
    if count:
        part = board.answer(wire.Read(LABEL, 0, 1), wire.EventsFrame)
        insist("Read of the first event", part.snapshots, recorded.events[:1])
    board.refuse(wire.Read(LABEL, count, 1), RefusalReason.BAD_PARAMETER)
    board.refuse(wire.Read(OTHER_LABEL, 0, 0), RefusalReason.NO_SUCH_DROP)
    return f"{count} events"


def acknowledge_drop(board: BoardUnderTest) -> None:
    """See that only the right label and CRC-32 let a drop be forgotten."""
    recorded = board.drop()
    crc32 = recorded.certificate.crc32
    board.refuse(wire.Acknowledge(LABEL, crc32 ^ 1), RefusalReason.WRONG_CRC)
    board.refuse(wire.Acknowledge(OTHER_LABEL, crc32), RefusalReason.NO_SUCH_DROP)
    board.acknowledge(recorded)
    board.insist_state("Acknowledge", phase=Phase.IDLE)
    board.refuse(wire.Acknowledge(LABEL, crc32), RefusalReason.NO_SUCH_DROP)


def arm_while_cooling(board: BoardUnderTest) -> str:
    """See that a release rests after its pulse. Drives release 0."""
    need(board.options.release, "leave to drive release 0: --release")
    pulse = {"release": 1, "pulse_us": PULSE_US}
    board.acknowledge(board.drop(**pulse))
    # It must rest for 150 ms, of which a slow line takes some.
    refused = board.refuse(board.order(**pulse), RefusalReason.COOLING)
    if not 0 < refused.detail <= 3 * PULSE_US // 1000 + 1:
        limit = f"a rest of at most {3 * PULSE_US // 1000} ms"
        raise wrong_answer("Arm after a pulse", limit, f"{refused.detail} ms")
    board.clock.sleep(1.02e-3 * refused.detail)
    board.read_token(board.ask(board.order(**pulse)))
    return f"{refused.detail} ms more"


def measure_sync_edges(board: BoardUnderTest) -> str:
    """See that FIRE makes the one edge of the sync output, at once, and how exactly at once.

    The output goes high with FIRE; its way back ends the recording and so is in no drop.
    """
    loopback, identity = board.options.loopback, board.identity
    need(loopback is not None, "a wire from the sync output to a gate: --loopback GATE")
    gate = loopback or 0
    last = identity.gates - 1
    need(gate <= last, f"gate {gate}, and this board has gates 0 to {last}")
    restless = board.gates.stuck | board.gates.flickering
    fail_if(restless >> gate & 1, "sync_blocked", gate=gate)
    late = [_sync_edge(board, gate) for _ in range(board.options.drops)]
    us = [1e6 * ticks / identity.tick_hz for ticks in late]
    scatter = f"{stdev(us):.3f} µs" if len(us) > 1 else "unknown"
    latency = (
        f"{len(us)} drops, latency {fmean(us):+.3f} µs, scatter {scatter}, "
        f"{min(us):+.3f} to {max(us):+.3f} µs"
    )
    allowed = identity.late_ticks
    fail_if(max(map(abs, late)) > allowed, "sync_late", latency=latency, ticks=allowed)
    return latency


def _sync_edge(board: BoardUnderTest, gate: int) -> int:
    """Fire once; give the ticks from FIRE to the edge."""
    mask = 1 << gate
    recorded = board.acknowledge(board.drop(gates=mask))
    states = [event.state for event in recorded.events]
    broken = states != [mask] or recorded.certificate.glitches
    fail_if(broken, "sync_edges", gate=gate, events=len(states))
    return ticks_since(recorded.certificate.fire_tick, recorded.events[0].tick)
