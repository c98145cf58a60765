"""Checks of what a board must answer: who it is, and what each phase of a drop allows.

Nothing falls. The last check needs a wire, from the sync output to a gate input.
"""

from dataclasses import replace
from statistics import fmean, stdev

from rig.boards import GATES, RELEASES
from rig.link import messages as wire
from rig.link.messages import PROTOCOL_VERSION, TEST_RUN, Phase, RefusalReason
from rig.selftest.board import LABEL, OTHER_LABEL, PULSE_US, BoardUnderTest, name_gates
from rig.selftest.findings import fail_if, insist, need, wrong_answer

_CLOSE_S = 0.3
BAD_ORDERS = (
    ("label", 0),
    ("gates", 0),
    ("release", 0x80),
    ("release", 0),
    ("pulse_us", 0),
    ("pulse_us", 2**32 - 1),
    ("timeout_ms", 0),
    ("record_ms", 0),
)
"""Each makes an ARM that pulses a release one that no device may accept."""


def identify(board: BoardUnderTest) -> str:
    """See that the board introduces itself, sensibly and twice alike."""
    identity = board.connect()
    names = identity.board, identity.firmware, identity.channels
    numbers = identity.gates, identity.releases, identity.tick_hz // 10**6, identity.capacity // 100
    complete = all((*names, *numbers, any(identity.unique_id)))
    if not complete or len(identity.channels.split()) != identity.gates:
        expected = "names, an id, a name a gate, a release, ticks of 1 MHz, room for 100 events"
        raise wrong_answer("Identify", expected, identity)
    insist("a second Identify", board.ask(wire.Identify()), identity)
    return f"{identity.board}, {identity.firmware}, id {identity.unique_id.hex()}"


def send_bad_requests(board: BoardUnderTest) -> None:
    """See that what is no request of this version is refused, whatever the board is doing."""
    for version in (0, PROTOCOL_VERSION + 1):
        board.refuse(wire.Identify(version), RefusalReason.VERSION, PROTOCOL_VERSION)
    for code in (0x55, 0x00, 0x82, 0xFF):
        board.refuse((code, b""), RefusalReason.UNKNOWN_MESSAGE, code)
    for code, kind in wire.TABLE.items():
        if code < 0x80 and kind is not wire.Flash:  # not every board knows it
            _, payload = wire.pack(kind(*[1 for _ in wire.FIELDS[kind]]))
            for other in (payload + b"\1", payload[:-1]):
                if other != payload:
                    board.refuse((code, other), RefusalReason.BAD_PARAMETER)


def look_at_gates(board: BoardUnderTest) -> str:
    """See that every gate in use is clear and keeps still."""
    states, fitted = board.gates, (1 << board.identity.gates) - 1
    in_use = board.options.gates
    counted = fitted if in_use is None else in_use
    faults = {
        "gates_not_fitted": counted & ~fitted,
        "gates_flicker": states.sometimes & ~states.always & counted,
        "gates_blocked": states.always & (in_use or 0),
    }
    for code, mask in faults.items():
        fail_if(mask, code, gates_listed=name_gates(mask))
    stuck = name_gates(states.always)
    which = "the gates in use, by --protocol FILE or --gates 0,1,8,9"
    need(in_use is not None or not states.always, f"{which}: {stuck} blocked all the time")
    unused = f"; not in use and blocked: {stuck}" if states.always else ""
    return f"{counted.bit_count()} gates clear{unused}"


def arm_blocked_gate(board: BoardUnderTest) -> str:
    """See that a gate that is blocked forbids arming."""
    board.settle()
    stuck = board.gates.always
    need(stuck, "a gate that is blocked by hand")
    gate = stuck & -stuck
    board.refuse(board.order(gates=gate), RefusalReason.GATE_BLOCKED, gate)
    return name_gates(gate)


def ask_while_idle(board: BoardUnderTest) -> None:
    """See that a board with nothing to do answers all that is not about a drop."""
    board.settle()
    board.expect(wire.Reference(), wire.ReferencePulse)
    board.refuse(wire.Fire(1), RefusalReason.NOT_ARMED)
    board.refuse(wire.Read(LABEL, 0, 1), RefusalReason.NO_SUCH_DROP)
    board.refuse(wire.Acknowledge(LABEL, 0), RefusalReason.NO_SUCH_DROP)


def send_bad_orders(board: BoardUnderTest) -> str:
    """See that no order is accepted that its table excludes."""
    board.settle()
    identity = board.identity
    changes = [
        *BAD_ORDERS,
        ("pulse_us", identity.max_pulse_us + 1),
        *(("gates", 1 << n) for n in range(identity.gates, GATES)),
        *(("release", 1 << n) for n in range(identity.releases, RELEASES)),
    ]
    good = board.order(release=1, pulse_us=PULSE_US)  # if it were fired
    for name, value in changes:
        board.refuse(replace(good, **{name: value}), RefusalReason.BAD_PARAMETER)
    return f"{len(changes)} orders"


def ask_while_armed(board: BoardUnderTest) -> None:
    """See that only the latest token fires, and that of all else only ABORT disarms."""
    old = board.prepare()
    board.state(phase=Phase.ARMED, label=LABEL, events=0)
    board.refuse(wire.Fire(old ^ 1), RefusalReason.WRONG_TOKEN)
    token = board.expect(board.order(), wire.Armed).token
    board.refuse(wire.Fire(old), RefusalReason.WRONG_TOKEN)
    board.refuse(board.order(gates=0), RefusalReason.BAD_PARAMETER)
    board.state(phase=Phase.ARMED)
    board.abort()
    board.refuse(wire.Fire(token), RefusalReason.NOT_ARMED)


def ask_while_recording(board: BoardUnderTest) -> None:
    """See that nothing else is begun while the board records, and that ABORT ends it at once."""
    token = board.prepare(record_ms=20_000)
    board.fire(token)
    board.state(phase=Phase.RECORDING, label=LABEL)
    board.refuse(board.order(label=OTHER_LABEL), RefusalReason.BUSY)
    board.refuse(wire.Read(LABEL, 0, 0), RefusalReason.BUSY)
    board.refuse(wire.Acknowledge(LABEL, 0), RefusalReason.BUSY)
    board.refuse(wire.Fire(token), RefusalReason.NOT_ARMED)
    board.abort()
    board.wait_for(_CLOSE_S, lambda heard: isinstance(heard.message, wire.DropCertificate))
    board.state(phase=Phase.HOLDING)


def ask_while_holding(board: BoardUnderTest) -> None:
    """See that a held drop is what was ordered and sent, and stays until it is armed anew."""
    gate = board.quiet_gate()
    tick = board.fire(board.prepare(gates=gate))
    seal = board.collect_drop().certificate
    certified = seal.gates, seal.initial_state, seal.fire_tick
    insist("the certificate of a drop", certified, (gate, 0, tick))
    board.state(phase=Phase.HOLDING, label=LABEL, events=seal.events)
    insist("Read", board.ask(wire.Read(LABEL, 0, 0)), seal)
    board.refuse(wire.Read(LABEL, seal.events, 1), RefusalReason.BAD_PARAMETER)
    board.refuse(wire.Read(OTHER_LABEL, 0, 0), RefusalReason.NO_SUCH_DROP)
    board.refuse(wire.Acknowledge(LABEL, seal.crc32 ^ 1), RefusalReason.WRONG_CRC)
    board.refuse(wire.Acknowledge(OTHER_LABEL, seal.crc32), RefusalReason.NO_SUCH_DROP)
    board.refuse(board.order(), RefusalReason.HOLDING_A_DROP, TEST_RUN)
    board.abort()
    board.refuse(board.order(label=OTHER_LABEL), RefusalReason.HOLDING_A_DROP, TEST_RUN)
    board.expect(board.order(), wire.Armed)


def arm_while_cooling(board: BoardUnderTest) -> str:
    """See that a release rests after its pulse. Drives release 0."""
    need(board.options.release, "leave to drive release 0: --release")
    pulse = {"release": 1, "pulse_us": PULSE_US}
    board.acknowledge(LABEL, board.drop(**pulse).certificate.crc32)
    # It must rest for 150 ms, of which a slow line takes some.
    refused = board.expect(board.order(**pulse), wire.Refused, reason=RefusalReason.COOLING)
    rest_ms, limit_ms = refused.detail, 3 * PULSE_US // 1000 + 1
    answers = {"expected": f"a rest of at most {limit_ms} ms", "answer": f"{rest_ms} ms"}
    fail_if(not 0 < rest_ms <= limit_ms, "wrong_answer", request="Arm after a pulse", **answers)
    board.clock.sleep(1.02e-3 * rest_ms)
    board.expect(board.order(**pulse), wire.Armed)
    return f"{rest_ms} ms more"


def measure_sync_edges(board: BoardUnderTest) -> str:
    """See that FIRE makes the one edge of the sync output, at once, and how exactly at once.

    The output goes high with FIRE; its way back ends the recording and so is in no drop.
    """
    loopback, identity = board.options.loopback, board.identity
    need(loopback is not None, "a wire from the sync output to a gate: --loopback GATE")
    gate = loopback or 0
    last = identity.gates - 1
    need(gate <= last, f"gate {gate}, and this board has gates 0 to {last}")
    fail_if(board.gates.sometimes >> gate & 1, "sync_blocked", gate=gate)
    late = []
    for _ in range(board.options.drops):
        edges, seal = board.drop(gates=1 << gate)
        fail_if(seal.events != 1 or not edges, "sync_edges", gate=gate, events=seal.events)
        late.append(edges[0].tick)
    us = [1e6 * ticks / identity.tick_hz for ticks in late]
    scatter = f"{stdev(us):.3f} µs" if len(us) > 1 else "unknown"
    latency = (
        f"{len(us)} drops, latency {fmean(us):+.3f} µs, scatter {scatter}, "
        f"{min(us):+.3f} to {max(us):+.3f} µs"
    )
    allowed = identity.late_ticks
    fail_if(max(map(abs, late)) > allowed, "sync_late", latency=latency, ticks=allowed)
    return latency
