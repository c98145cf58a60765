"""What the device says, as the clients see it while it happens.

Provisional on purpose: frames that come out of order are left to the record, which the device's
certificate vouches for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.assembly import ALL_GATES, edges
from rig.link.transcript import Incoming, Record
from rig.reasons import Reason, published_reasons
from rig.session.schema import RunState

if TYPE_CHECKING:
    from rig.recorder.published import PublishedState
    from rig.records import Drop

_PHASES = {
    wire.Phase.IDLE: "idle",
    wire.Phase.ARMED: "armed",
    wire.Phase.RECORDING: "recording",
    wire.Phase.HOLDING: "storing",
}


class StateFeed:
    """Keeps device, gates, phase, drop and edges of the published state.

    Parameters
    ----------
    published
        Where clients look.
    """

    def __init__(self, published: PublishedState) -> None:
        self._published = published
        self._tick_hz = 0
        self._label = 0
        self._fire_tick: int | None = None
        self._state = 0  # of the armed gates, at the last event shown
        self._next = 0  # number of the event to come

    def know(self, record: Record) -> None:
        """Take what became known on the line."""
        if not isinstance(record, Incoming):
            return
        match record.message:
            case wire.Identity() as identity:
                self._tick_hz = identity.tick_hz
                self._published.set(device=identity.json())
            case wire.State(phase=phase, gates=gates):
                self._published.set(gates={"blocked": gates}, phase=_PHASES[phase])
            case wire.Disarmed():
                self._published.set(phase="idle")
            case wire.Fired(tick=tick) if self._label:
                self._fire_tick = tick
                self._drop("fired")
                self._published.set(phase="recording")
            case wire.EventsFrame(label=label) as frame if label == self._label:
                self._events(frame)
            case wire.DropCertificate():
                self._published.set(phase="storing")

    def state(self, run: int, attempt: int, state: RunState, reasons: tuple[Reason, ...]) -> None:
        """Take a line of the log of run states."""
        self._published.run(run, attempt=attempt, state=str(state), **published_reasons(reasons))
        if state is RunState.ARMED:
            self._show_armed(run, attempt)
        elif state is RunState.INTERRUPTED and self._label == wire.pack_label(run, attempt):
            self._drop("interrupted")
            self._label = 0

    def _show_armed(self, run: int, attempt: int) -> None:
        self._label = wire.pack_label(run, attempt)
        self._fire_tick, self._state, self._next = None, 0, 0
        self._published.replace_edges(())
        self._drop("armed")
        self._published.set(phase="armed")

    def show_drop(self, drop: Drop) -> None:
        """Show a drop as it was stored."""
        self._label = wire.pack_label(*drop.job)
        self._fire_tick = drop.fire_tick
        self._next = drop.certificate.events if drop.certificate else len(drop.edges)
        rows = () if self._blind else drop.edges
        self._published.replace_edges(
            (tick, channel, int(blocked)) for tick, channel, blocked in rows
        )
        self._drop("recorded")
        self._published.set(phase="idle")
        self._label = 0

    @property
    def _blind(self) -> bool:
        """Whether nobody shall see from the edges what is measured."""
        session = self._published.get("session")
        return session is not None and bool(session["blind"])

    def _drop(self, state: str) -> None:
        run, attempt = wire.unpack_label(self._label)
        self._published.set(
            drop={
                "run": run,
                "attempt": attempt,
                "state": state,
                "tick_hz": self._tick_hz,
                "fire_tick": self._fire_tick,
                "events": self._next,
            }
        )

    def _events(self, frame: wire.EventsFrame) -> None:
        if frame.first < self._next or self._fire_tick is None:
            return
        events = list(wire.EVENT.iter_unpack(frame.events))
        state = self._state
        if frame.first > self._next and events:
            state = events[0][1]  # it is not known when the gates changed
        rows = edges(events, state, ALL_GATES, self._fire_tick)
        self._state = events[-1][1] if events else state
        self._next = frame.first + len(events)
        if not self._blind:
            self._published.edges((tick, channel, int(blocked)) for tick, channel, blocked in rows)
        self._published.set(gates={"blocked": self._state})
        self._drop("fired")
