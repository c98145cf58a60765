"""A daemon's server that streams a drop's edges as from a board, and how late they come."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, TypeVar

from rig.daemon.server import Server
from rig.link.messages import Fired
from rig.link.transcript import Incoming
from rig.recorder.feed import StateFeed
from rig.records import Job
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

T = TypeVar("T")


def serve(folder: Path, work: Callable[[Server], T]) -> T:
    """Return what clients in a thread make of a server, whose socket is in a folder."""

    async def main() -> T:
        server, ready = Server("sim://", folder / "door" / "rig.sock"), asyncio.Event()
        serving = asyncio.get_running_loop().create_task(server.run(ready.set))
        await ready.wait()
        try:
            return await asyncio.to_thread(work, server)
        finally:
            server.end()
            await serving

    return asyncio.run(main())


def fire(server: Server) -> StateFeed:
    """Return the feed of a drop that has just been fired."""
    view = StateFeed(server.published)
    view.state(Job(1, 1), RunState.ARMED, ())
    view.know(Incoming(0, 1, Fired(0)))
    return view


def spread(times_s: Iterable[float]) -> dict[str, float]:
    """Return median and 99 % quantile."""
    ordered = sorted(times_s)
    return {"median": ordered[len(ordered) // 2], "p99": ordered[len(ordered) * 99 // 100]}
