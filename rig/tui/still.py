"""A rig that stands still at one moment: for pictures, and for tests of how screens look."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from rig.tui.client import ReconnectingClient

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.tui.state import State

GATES = {"blocked": 0, "age_s": 0.1}
QUIET: Mapping[str, Any] = {
    "daemon": {"version": "", "pid": 0, "api": 1},
    "port": {"url": "sim://", "simulated": True},
    "link": {"state": "up", "error": None, "retry_s": None},
    "device": {"board": "virtual", "firmware": "sim", "unique_id": "3be41d96e0299308",
               "tick_hz": 16_000_000},
    "statistics": {"rx_frames": 1204, "rx_bad": 0, "rx_unreadable": 0, "repeats": 0,
                   "round_trip_s": 0.0011},
    "gates": GATES,
    "phase": "idle",
    "drop": None,
    "session": None,
    "control": None,
    "clients": 1,
    "error": None,
}  # fmt: skip
"""Sections of a rig at rest, without a session."""


class Still(ReconnectingClient):
    """Shows one state and carries nothing out.

    Parameters
    ----------
    state
        What the daemon would say.
    """

    def __init__(self, state: State) -> None:
        super().__init__(str(state.section("port").get("url", "")), None, self._nothing)
        self._state = state

    @property
    def up(self) -> bool:
        """Always."""
        return True

    @property
    def driving(self) -> bool:
        """Always."""
        return True

    @property
    def state(self) -> State:
        """The one it was given."""
        return self._state

    async def call(self, method: str, **params: Any) -> Any:
        """Never answer."""
        del method, params
        await asyncio.Event().wait()

    async def keep(self) -> None:
        """Wait to be cancelled."""
        await asyncio.Event().wait()

    async def _nothing(self) -> None:
        return
