"""The daemon's state for the screens: typed and immutable.

See rig/daemon/API.md for the sections; `rig.daemon.replica` applies the changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from rig.recorder.run_lines import RunLine, plan_lines, read_line

if TYPE_CHECKING:
    from rig.results.live import SessionView

EMPTY: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class DaemonState:
    """State of the daemon.

    Attributes
    ----------
    sections
        Sections by name, as received, without the two below.
    runs
        The plan, in order.
    edges
        Edges of the latest drop, as received: tick, gate, state after it.
    """

    sections: Mapping[str, Any] = field(default_factory=lambda: EMPTY)
    runs: tuple[RunLine, ...] = ()
    edges: tuple[Sequence[int], ...] = ()

    def section(self, name: str) -> Mapping[str, Any]:
        """Return a section; empty if it is null."""
        section = self.sections.get(name)
        return section if isinstance(section, dict) else EMPTY

    @property
    def phase(self) -> str:
        """Phase of the daemon: ``idle``, ``armed``, ``recording``, ``storing`` or ``trouble``."""
        return str(self.sections.get("phase", "idle"))

    @property
    def link(self) -> str:
        """State of the port: ``closed``, ``opening``, ``up``, ``down``."""
        return str(self.section("link").get("state", "closed"))

    @property
    def blocked_mask(self) -> int | None:
        """Mask of the blocked gates; `None` if unknown."""
        mask = self.section("gates").get("blocked")
        return None if mask is None else int(mask)

    @property
    def holder(self) -> str | None:
        """Name of the client that has control."""
        name = self.section("control").get("client")
        return None if name is None else str(name)

    def line(self, run: int) -> RunLine | None:
        """Return the plan's line of a run; `None` if it is not planned."""
        return next((line for line in self.runs if line.run == run), None)


def read_state(state: Mapping[str, Any]) -> DaemonState:
    """Return the present state of the daemon's sections, unaffected by later changes.

    Parameters
    ----------
    state
        Sections by name; none before the first snapshot. Entries of its lists are replaced by the
        replica, never changed.
    """
    sections = {name: value for name, value in state.items() if name not in {"runs", "edges"}}
    runs, edges = map(read_line, state.get("runs") or ()), state.get("edges") or ()
    return DaemonState(sections, tuple(runs), tuple(edges))


def state_of(view: SessionView) -> DaemonState:
    """Return the state that a daemon would have for a file without a writer."""
    runs = plan_lines(view.plan.values(), view.states)
    session = {"path": str(view.path), "title": view.protocol.title, "simulated": view.simulated}
    return DaemonState({"session": session}, tuple(runs))
