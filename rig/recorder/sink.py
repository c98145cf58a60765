"""Where a recorder writes: a session, or nowhere for a device without one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.link.transcript import Direction
    from rig.reasons import Reason
    from rig.records import ClockSample, Drop, HostBreak, Pulse
    from rig.session.schema import RunState


class SessionSink(Protocol):
    """Where a recorder puts what happens; `rig.session.store.Session` is the one that keeps it."""

    def log_bytes(self, direction: Direction, host_ns: int, data: bytes) -> None: ...  # noqa: D102

    def add_identity(self, identity: Mapping[str, object], host_ns: int) -> None: ...  # noqa: D102

    def add_ping(self, ping: ClockSample) -> None: ...  # noqa: D102

    def add_pulse(self, pulse: Pulse) -> None: ...  # noqa: D102

    def add_host_break(self, found: HostBreak) -> None: ...  # noqa: D102

    def add_drop(self, drop: Drop, *, host_ns: int | None, provenance: str) -> None: ...  # noqa: D102

    def add_state(  # noqa: D102
        self, run: int, attempt: int, state: RunState, host_ns: int, reasons: Sequence[Reason] = ()
    ) -> None: ...

    def drop(self, run: int, attempt: int) -> Drop | None: ...  # noqa: D102

    def commit(self) -> None: ...  # noqa: D102


class NullSink:
    """Nothing is kept. A recorder with this one watches, and never arms."""

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
