"""Where a recorder of a device without a session writes: nowhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.link.transcript import Direction
    from rig.reasons import Reason
    from rig.records import ClockSample, Drop, HostBreak, Pulse
    from rig.session.schema import RunState


class NullSink:
    """What a recorder uses of a session. Nothing is kept: it watches, and never arms."""

    def log_bytes(self, direction: Direction, host_ns: int, data: bytes) -> None:
        """Forget bytes."""

    def add_identity(self, identity: Mapping[str, object], host_ns: int) -> None:
        """Forget who was there."""

    def add_ping(self, ping: ClockSample) -> None:
        """Forget a clock sample."""

    def add_pulse(self, pulse: Pulse) -> None:
        """Forget a pulse of the reference."""

    def add_host_break(self, found: HostBreak) -> None:
        """Forget that the host slept."""

    def add_drop(self, drop: Drop, *, host_ns: int | None, provenance: str) -> None:
        """Refuse: a drop is never forgotten."""
        raise NotImplementedError

    def add_state(
        self, run: int, attempt: int, state: RunState, host_ns: int, reasons: Sequence[Reason] = ()
    ) -> None:
        """Refuse: a run belongs to a session."""
        raise NotImplementedError

    def drop(self, run: int, attempt: int) -> Drop | None:
        """Know none."""

    def commit(self) -> None:
        """Do nothing."""
