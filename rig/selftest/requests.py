"""Requests that every device must refuse, and one good example of each kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.boards import GATES, RELEASES
from rig.link import messages as wire

if TYPE_CHECKING:
    from collections.abc import Iterator

BAD_ORDERS: tuple[dict[str, int], ...] = (
    {"label": 0},
    {"gates": 0},
    {"release": 0x80},
    {"release": 0},
    {"pulse_us": 0},
    {"pulse_us": 2**32 - 1},
    {"timeout_ms": 0},
    {"record_ms": 0},
)
"""Each makes an ARM that pulses a release one that no device may accept."""

UNKNOWN_CODES = (0x55, 0x00, 0x82, 0xFF)
"""Types that are no requests."""


def beyond(identity: wire.Identity) -> Iterator[dict[str, int]]:
    """Ask for what this very device says it has not."""
    yield {"pulse_us": identity.max_pulse_us + 1}
    if identity.gates < GATES:
        yield {"gates": 1 << identity.gates}
    if identity.releases < RELEASES:
        yield {"release": 1 << identity.releases}


def wrong_lengths(order: wire.Arm) -> Iterator[tuple[int, bytes]]:
    """Give every request with a byte too many, and with one too few.

    Parameters
    ----------
    order
        An ARM that would be accepted.
    """
    examples: dict[type[wire.Message], wire.Message] = {
        wire.Arm: order,
        wire.Fire: wire.Fire(1),
        wire.Read: wire.Read(order.label, 0, 1),
        wire.Acknowledge: wire.Acknowledge(order.label, 0),
    }
    for code, kind in wire.TABLE.items():
        if code < 0x80:
            example = examples[kind] if kind in examples else kind()
            _, payload = wire.pack(example)
            yield code, payload + b"\1"
            if payload:
                yield code, payload[:-1]
