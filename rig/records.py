"""What a drop leaves behind, as plain data: edges, pings, certificates.

These are the words in which link, session and analysis speak to each other.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

from rig.reasons import Reason

Direction: TypeAlias = Literal["tx", "rx"]
"""Of bytes on the line; ``tx``: host to device."""


class Edge(NamedTuple):
    """One change of one gate.

    `tick` counts device ticks from the fire stamp (imports: from the first whole second of the
    run); `blocked` is the state after the change.
    """

    tick: int
    channel: int
    blocked: bool


class Job(NamedTuple):
    """One attempt at one run."""

    run: int
    attempt: int

    def __str__(self) -> str:
        return f"run {self.run}, attempt {self.attempt}"


class ClockSample(NamedTuple):
    """One clock sample: host time before and after, and the device's tick between (u32)."""

    host_send_ns: int
    host_recv_ns: int
    tick: int


class Pulse(NamedTuple):
    """What the device said of its 1 Hz reference, and the host time before and after it was asked.

    `number` is how many pulses there were (u16), `tick` that of the latest (u32).
    """

    host_send_ns: int
    host_recv_ns: int
    number: int
    tick: int


class HostBreak(NamedTuple):
    """The host's clocks did not go on as one: by how much, and when that was noticed.

    `slept_ns` passed without the monotonic clock; the wall clock was set by `stepped_ns`.
    """

    host_ns: int
    slept_ns: int
    stepped_ns: int


@dataclass(frozen=True, slots=True)
class Certificate:
    """The device's own account of a drop.

    Attributes
    ----------
    events
        Number of snapshots recorded.
    crc32
        CRC-32 over their six-byte records in order.
    overflows
        Snapshots lost because the memory was full.
    glitches
        Snapshots of pulses too short to be seen.
    late
        Stamps that may be late by more than the usual latency.
    release_sense
        Ticks from the fire stamp to the first change of the release-sense input; `None` when it
        did not change.
    pulse_ticks
        How long the release was on; `None`, as all that follows, from a device that does not say.
    pulse_end
        What ended the pulse, see `rig.link.messages.PulseEnd`.
    restarts
        0, or 128 and the causes of all restarts since the device said who it is.
    supply_mv, lowest_mv
        The board's supply when it fired, and its lowest while it recorded; 0 where not measured.
    """

    events: int
    crc32: int
    overflows: int = 0
    glitches: int = 0
    late: int = 0
    release_sense: int | None = None
    pulse_ticks: int | None = None
    pulse_end: int | None = None
    restarts: int | None = None
    supply_mv: int | None = None
    lowest_mv: int | None = None


@dataclass(frozen=True, slots=True)
class Drop:
    """The raw record of one drop.

    Attributes
    ----------
    run, attempt
        The planned run, and which attempt at it (1, 2, …).
    tick_hz
        Nominal tick rate.
    fire_tick
        Device tick (u32) of the release; `None` for imported edges.
    initial_state
        Gate mask when armed.
    edges
        In order of time.
    certificate
        `None` for imported edges.
    faults
        Why the record is not whole (empty when it is): a void run says these as its reasons.
    damage
        Why the stored record is not the one that was made; empty where it is. A damaged record
        has no edges: it tells nothing of the rig.
    """

    run: int
    attempt: int
    tick_hz: int
    edges: tuple[Edge, ...]
    fire_tick: int | None = None
    initial_state: int = 0
    certificate: Certificate | None = None
    faults: tuple[Reason, ...] = ()
    damage: str = ""

    @property
    def job(self) -> Job:
        """The attempt that it was."""
        return Job(self.run, self.attempt)
