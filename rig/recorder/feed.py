"""What the device says, as the clients see it while it happens.

Provisional on purpose: frames that come out of order are left to the record, which the device's
certificate vouches for.
"""

from rig.link import messages as wire
from rig.link.assembly import ALL_GATES, edges
from rig.link.transcript import Incoming, Record
from rig.reasons import Reason, reasons_json
from rig.recorder.published import PublishedState
from rig.records import Drop, Edge, Job
from rig.session.schema import Reasons, RunState

_PHASES = dict(zip(wire.Phase, ("idle", "armed", "recording", "storing"), strict=True))


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
        # Of the drop that is armed or falls, 0 for none; and its gates at the last event shown.
        self._label = self._gates = 0

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
                self._show(state="fired", fire_tick=tick)
                self._published.set(phase="recording")
            case wire.EventsFrame(label=label) as frame if 0 != label == self._label:
                self._events(frame)
            case wire.DropCertificate():
                self._published.set(phase="storing")

    def state(self, job: Job, state: RunState, reasons: Reasons) -> None:
        """Take a line of the log of run states."""
        why = reasons_json(reasons, Reason.record)
        self._published.run(job.run, attempt=job.attempt, state=str(state), **why)
        if state is RunState.ARMED:
            self._label, self._gates = wire.pack_label(*job), 0
            self._published.replace_edges(())
            self._begin(job, "armed")
            self._published.set(phase="armed")
        elif state is RunState.INTERRUPTED:
            self._label = 0
            drop = self._published.get("drop")  # perhaps of the connection before
            if drop is not None and (drop["run"], drop["attempt"]) == job:
                self._show(state="interrupted")

    def show_drop(self, drop: Drop) -> None:
        """Show a drop as it was stored."""
        self._label = 0
        events = drop.certificate.events if drop.certificate else len(drop.edges)
        self._published.replace_edges(() if self._blind else map(_row, drop.edges))
        self._begin(drop.job, "recorded", drop.fire_tick, events)
        self._published.set(phase="idle")

    @property
    def _blind(self) -> bool:
        """Whether nobody shall see from the edges what is measured."""
        session = self._published.get("session")
        return session is not None and bool(session["blind"])

    def _begin(self, job: Job, state: str, fire_tick: int | None = None, events: int = 0) -> None:
        drop = job._asdict() | {"state": state, "tick_hz": self._tick_hz}
        self._published.set(drop=drop | {"fire_tick": fire_tick, "events": events})

    def _show(self, **changes: object) -> None:
        self._published.set(drop=self._published.get("drop") | changes)

    def _events(self, frame: wire.EventsFrame) -> None:
        drop = self._published.get("drop")
        number, fire_tick = drop["events"], drop["fire_tick"]
        if frame.first < number or fire_tick is None:
            return
        if frame.first > number and frame.snapshots:
            self._gates = frame.snapshots[0].state  # it is not known when the gates changed
        before = [self._gates, *(event.state for event in frame.snapshots)]
        self._gates = before[-1]
        if not self._blind:
            self._published.edges(map(_row, edges(frame.snapshots, before, ALL_GATES, fire_tick)))
        self._published.set(gates={"blocked": self._gates})
        self._show(state="fired", events=frame.first + len(frame.snapshots))


def _row(edge: Edge) -> tuple[int, int, int]:
    return edge.tick, edge.channel, int(edge.blocked)
