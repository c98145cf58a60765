"""Gathering facts about a board. No release is driven, and no drop of anybody is touched."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rig.doctor.facts import BoardFacts
from rig.flash.boards import TARGETS
from rig.flash.image import read_image
from rig.link.client import Device
from rig.link.gatewatch import watch_gates
from rig.link.messages import TEST_RUN, Phase, Reason, pack_label, unpack_label
from rig.link.refusals import DeviceRefusedError

if TYPE_CHECKING:
    from rig.clock.host import Clock
    from rig.link.messages import Identity
    from rig.link.port import Port
    from rig.records import Edge

WATCH_S = 1.0
_GLANCE_S = 0.3
_PINGS = 40
_LABEL = pack_label(TEST_RUN, 1)
_TRIES = 40
_AGAIN = (Reason.GATE_BLOCKED, Reason.GATE_UNSTEADY)
"""Refusals that a flickering gate gives now and then."""


def look_at_board(port: Port, clock: Clock) -> BoardFacts:
    """Ask a board about everything that can be asked in a few seconds.

    Raises
    ------
    DeviceError
        It does not answer, or speaks another version.
    """
    device = Device(port, clock)
    identity = device.connect()
    pings = []
    for n in range(_PINGS):
        ping = device.ping()
        if ping is not None:
            pings.append(ping)
        clock.sleep(0.023 + 0.0071 * (n % 5))
    state = device.status()
    states = watch_gates(lambda: device.status().gates, clock, _GLANCE_S)
    edges, unwatched, stopped = None, "it holds a drop", False
    if state.phase is Phase.IDLE:
        edges, unwatched, stopped = _recorded(device, ((1 << identity.gates) - 1) & ~states.stuck)
    held = unpack_label(state.label) if state.phase is Phase.HOLDING else None
    return BoardFacts(
        identity, _shipped(identity), tuple(pings), held, states, edges, WATCH_S, unwatched, stopped
    )


def _shipped(identity: Identity) -> str:
    for target in TARGETS.values():
        if target.board.name == identity.board:
            return read_image(target.shipped, target).firmware
    return ""


def _recorded(device: Device, gates: int) -> tuple[tuple[Edge, ...] | None, str, bool]:
    """Record the gates for a while with all releases off; else say why not, and if it is stopped.

    A board fires only when all its gates are clear and keep still. One that flickers with the
    mains does so for some milliseconds between two pulses, so a few tries in a row get there.
    """
    if not gates:
        return None, "all gates are blocked", False
    why, stopped = "", False
    for _ in range(_TRIES):
        try:
            token = device.arm(
                label=_LABEL,
                gates=gates,
                release=0,
                pulse_us=0,
                timeout_ms=1000,
                record_ms=round(WATCH_S * 1000),
            )
            device.fire(token)
        except DeviceRefusedError as refusal:
            why, stopped = refusal.message, refusal.reason is Reason.STOPPED
            if refusal.reason not in _AGAIN:
                break
            continue
        drop = device.collect(_LABEL)
        if drop.certificate is not None:
            device.acknowledge(_LABEL, drop.certificate.crc32)
        return drop.edges, "", False
    with suppress(DeviceRefusedError):
        device.abort()
    return None, why, stopped
